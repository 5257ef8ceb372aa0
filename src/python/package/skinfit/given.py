"""What is given: paths, names and arrays, checked where they come in."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from os import PathLike
from typing import Any, TypeVar, Union

import numpy as np
from numpy.typing import NDArray

from .errors import ArrayError, Error

FilePath = Union[str, "PathLike[str]"]
"""A path to a file or folder."""

Names = Union[str, Iterable[str]]
"""Names; one may stand for itself."""

Number = TypeVar("Number", bound=np.generic)

_KINDS = {
    "b": "truth values",
    "i": "integers",
    "u": "integers",
    "f": "floating-point numbers",
    "c": "complex numbers",
    "U": "words",
    "S": "bytes",
    "O": "objects that are no numbers, or lists of different lengths",
}


def names(given: Names, refused: type[Error]) -> list[str]:
    """The names as a list; one name is a list of one. Raises `refused` for what is no name."""
    if isinstance(given, str):
        return [name(given, refused)]
    if not isinstance(given, Iterable):
        raise refused(f"{given!r} is neither a name nor a list of names. Give one, or a list.")
    return [name(each, refused) for each in given]


def name(given: object, refused: type[Error]) -> str:
    """A name that can be written down. Raises `refused` for anything else."""
    if not isinstance(given, str):
        raise refused(f"{given!r} is no name. Give a word in quotes.")
    if not encodable(given):
        raise refused(f"{given!r} holds half of a character, which no file can. Give another name.")
    return given


def encodable(words: str) -> bool:
    """Whether it can be written as UTF-8: halves of surrogate pairs cannot."""
    try:
        words.encode()
    except UnicodeEncodeError:
        return False
    return True


def numbers(
    what: str,
    value: Any,
    kind: type[Number],
    remedy: str,
    *,
    kinds: str = "f",
    finite: bool = True,
    refused: type[Error] = ArrayError,
) -> NDArray[Number]:
    """The array of `kind` that `value` stands for.

    Raises `refused`, with `remedy`, where it holds another of NumPy's `kinds` than named, and, where they have to be
    `finite`, numbers that are not or that `kind` has no room for.
    """
    array = _array(what, value, remedy, refused)
    # Of a list without entries NumPy makes floats.
    if array.dtype.kind not in kinds and array.size:
        held = _KINDS.get(array.dtype.kind, str(array.dtype))
        raise refused(f"{what}: holds {held} ({array.dtype}). {remedy}")
    if finite and array.dtype.kind == "f":
        _check(what, array, np.isfinite(array), "is not finite", remedy, refused)
    with np.errstate(over="ignore"):
        taken = array.astype(kind)
    if finite and array.dtype.kind == "f":
        _check(what, array, np.isfinite(taken), f"is beyond what {np.dtype(kind)} holds", remedy, refused)
    return taken


def _array(what: str, value: Any, remedy: str, refused: type[Error]) -> NDArray[Any]:
    if isinstance(value, np.ma.MaskedArray):
        raise refused(f"{what}: is a masked array, whose mask would be lost. Fill it: array.filled(...).")
    try:
        with warnings.catch_warnings():
            # Older NumPy warns of lists of different lengths, and makes objects of them.
            warnings.simplefilter("ignore")
            return np.asarray(value)
    except (ValueError, TypeError, RuntimeError, OverflowError) as error:
        raise refused(f"{what}: is no array of numbers: {error}. {remedy}") from error


def _check(what: str, array: NDArray[Any], good: NDArray[np.bool_], wrong: str, remedy: str, refused: type[Error]) -> None:
    if not good.all():
        place = tuple(int(index) for index in np.argwhere(~good)[0])
        at = "[" + ", ".join(map(str, place)) + "]" if place else ""
        raise refused(f"{what}{at}: {array[place]} {wrong}. {remedy}")
