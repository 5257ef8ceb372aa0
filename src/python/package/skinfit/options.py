"""How a fit goes about it: what may be asked for, checked before the command line sees it."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, get_args, get_type_hints

import numpy as np

from .errors import FitError


class FitOptions(TypedDict, total=False):
    """How a fit goes about it; what is not given is as of `skinfit fit`."""

    solver: Literal["varpro", "lm", "lbfgs", "nelder-mead", "adam"]
    loss: Literal["l2", "relative_l2", "huber", "smape"]
    """Instead of the scenes' own."""
    starts: int
    """Fit from this many starts and keep the best."""
    seed: int
    """What the other starts are drawn from."""
    max_iterations: int
    """Of each start."""
    engine: Literal["auto", "cpu", "gpu"]
    """What makes the passes."""
    samples: Literal["cpu", "gpu"]
    """What makes the GPU engine's samples."""
    adapter: str
    """Part of a graphics adapter's name."""
    device_memory: int
    """Most megabytes of samples that stay on the adapter."""
    verify: bool
    """Hold the first pass against the model in f64."""


# The least and the greatest number that an option takes.
_MOST = 2**64 - 1
_RANGES = {"starts": (1, 10_000), "seed": (0, _MOST), "max_iterations": (1, _MOST), "device_memory": (0, _MOST)}


def words_of(options: Mapping[str, Any]) -> list[str]:
    """Options as words of the command line; `None` stands for one that is not given. Raises `FitError` for what one does not
    take, and `TypeError` for what is none."""
    kinds = get_type_hints(FitOptions)
    unknown = sorted(set(options) - set(kinds))
    if unknown:
        raise TypeError(f"a fit has no option {', '.join(unknown)}; it has {', '.join(kinds)}.")
    given = {name: value for name, value in options.items() if value is not None}
    return [word for name, value in given.items() for word in _words(name, value, kinds[name])]


def _words(name: str, value: Any, kind: Any) -> list[str]:
    option = "--" + name.replace("_", "-")
    if kind is bool:
        return [option] if _flag(name, value) else []
    if kind is int:
        return [f"{option}={_whole(name, value)}"]
    known = get_args(kind)
    if not isinstance(value, str) or (known and value not in known):
        raise _refused(name, value, " or ".join(map(repr, known)) or "a str")
    return [f"{option}={value}"]


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise _refused(name, value, "True or False")
    return bool(value)


def _whole(name: str, value: Any) -> int:
    least, most = _RANGES[name]
    takes = f"a whole number from {least} on" if most == _MOST else f"a whole number from {least} to {most}"
    try:
        number = operator.index(value)
    except TypeError:
        raise _refused(name, value, takes) from None
    if isinstance(value, bool) or not least <= number <= most:
        raise _refused(name, value, takes)
    return number


def _refused(name: str, value: Any, takes: str) -> FitError:
    return FitError(f"{name} = {value!r}: it takes {takes}.")
