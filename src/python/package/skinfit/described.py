"""A scene as a dictionary: its text as TOML, and its arrays as files beside it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native, exr
from .errors import ArrayError, FileError, SceneError
from .given import encodable, numbers
from .mesh import glb
from .scratch import place

# Where a scene names files: of the tables these keys, of each view these.
_FILES = {
    "mesh": ("file",),
    "environment": ("file",),
    "maps": ("color", "normal", "specular", "attenuator"),
}
_OF_VIEW = ("target", "mask", "haze", "response")

# What is light, and what are numbers as they are.
_LIGHT = (
    "Give floating-point numbers of linear light: codes divided by 255 (65535 of 16 bits), with sRGB's curve undone; or "
    "the path of the picture, which is read so."
)
_PLAIN = "Give floating-point numbers: codes divided by 255 (65535 of 16 bits) lie in [0, 1] and have no curve to undo."
_MASK = "Give truth values, or floating-point numbers in [0, 1]: codes divided by 255."
_LIGHTS = ("file", "color", "target", "haze")


def describe(scene: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write the scene as `scene.toml` in `folder`, with a file for each array: the files that were not there. Nothing is
    written where something is wrong, or another scene is there."""
    if not isinstance(scene, Mapping):
        raise SceneError(f"{scene!r} is no dictionary. To read a scene file, call load_file.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Beside its place, so that it is there whole or not at all.
        with tempfile.TemporaryDirectory(prefix=".skinfit-", dir=folder) as beside:
            _write(scene, Path(beside))
            return place(Path(beside), folder)
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{folder}: cannot be written: {error.strerror}. Name another folder.") from error


def _write(scene: Mapping[str, Any], folder: Path) -> None:
    writer = _Writer(folder)
    tables: dict[str, Any] = {}
    for key, value in scene.items():
        if key == "view":
            tables[key] = [writer.view(view) for view in _views(value)]
        elif isinstance(value, Mapping):
            tables[key] = writer.table(key, value)
        else:
            tables[key] = value
    (folder / "scene.toml").write_text(toml(tables), encoding="utf-8")


def _views(given: Any) -> Sequence[Mapping[str, Any]]:
    if not isinstance(given, (list, tuple)) or not all(isinstance(view, Mapping) for view in given):
        raise SceneError("view: is no list of dictionaries. Give a list with a dictionary for each view, as [{...}].")
    return given


class _Writer:
    """Writes arrays into a folder, and gives the paths that stand for them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stems: set[str] = set()

    def table(self, name: str, table: Mapping[str, Any]) -> dict[str, Any]:
        written = dict(table)
        for key in _FILES.get(name, ()):
            if key in written:
                written[key] = self._file(name, key, written[key])
        terms = written.get("terms")
        if name == "model" and isinstance(terms, (list, tuple)):
            written["terms"] = [self._term(term) for term in terms]
        own = written.get("own")
        if name == "maps" and isinstance(own, Mapping):
            written["own"] = {key: self._file("maps.own", str(key), value) for key, value in own.items()}
        return written

    def _term(self, term: Any) -> Any:
        """A file of rules, or a family's with its names."""
        if isinstance(term, Mapping):
            if not isinstance(term.get("file"), (str, PathLike)):
                raise SceneError('model.terms: a family names no file. Give {"file": ..., "names": [...]}.')
            return {**term, "file": _absolute("model.terms", term["file"])}
        return _absolute("model.terms", term) if isinstance(term, (str, PathLike)) else term

    def view(self, view: Mapping[str, Any]) -> dict[str, Any]:
        name = str(view.get("name", "view"))
        written = dict(view)
        for key in _OF_VIEW:
            if key in written and not (key == "response" and _is_number(written[key])):
                written[key] = self._file(f"view.{name}", key, written[key])
        return written

    def _file(self, table: str, key: str, value: Any) -> str:
        """The path of what a scene names: that of a file, or of one with these numbers."""
        what = f"{table}.{key}"
        if isinstance(value, (str, PathLike)):
            return _absolute(what, value)
        stem = self._stem(what)
        if what == "mesh.file" and isinstance(value, Mapping):
            return self._written(stem + ".glb", glb(value))
        if key == "response" and table.startswith("view."):
            return self._written(stem + ".csv", _response(what, value))
        if key == "haze" and table.startswith("view."):
            return self._written(stem + ".exr", exr.plane("haze.Y", _plane(what, value)))
        path = self._folder / f"{stem}.exr"
        _native.write_exr(path, image(what, value, *_asked(table, key)))
        return path.name

    def _written(self, name: str, content: bytes) -> str:
        (self._folder / name).write_bytes(content)
        return name

    def _stem(self, what: str) -> str:
        """A file's name of its own, whatever a view is called."""
        plain = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in what)
        stem, number = plain, 1
        while stem.lower() in self._stems:
            number += 1
            stem = f"{plain}_{number}"
        self._stems.add(stem.lower())
        return stem


def _asked(table: str, key: str) -> tuple[str, str]:
    """What an image has to hold: what to do where it holds something else, and the kinds of numbers."""
    if key == "mask" and table.startswith("view."):
        return _MASK, "fb"
    return (_PLAIN if table == "maps.own" or key not in _LIGHTS else _LIGHT), "f"


def _absolute(what: str, path: str | PathLike[str]) -> str:
    words = fspath(path)
    if not isinstance(words, str):
        raise SceneError(f"{what}: {words!r} is no path of characters. Give it as str.")
    return str(Path(words).absolute())


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.number)) or (isinstance(value, np.ndarray) and value.ndim == 0)


def image(what: str, value: Any, remedy: str, kinds: str = "f") -> NDArray[np.float32]:
    """An array as (height, width, 3 or 4) float32; one number a pixel becomes three."""
    taken = numbers(what, value, np.float32, remedy, kinds=kinds)
    if taken.ndim == 2:
        taken = np.repeat(taken[:, :, None], 3, axis=2)
    if taken.ndim != 3 or taken.shape[2] not in (3, 4) or not taken.size:
        raise ArrayError(
            f"{what}: an array of shape {np.shape(value)} is no image. Give (height, width), (height, width, 3) or, with "
            "coverage, (height, width, 4)."
        )
    return np.ascontiguousarray(taken)


def _plane(what: str, value: Any) -> NDArray[np.float32]:
    """An image of one number a pixel."""
    taken = numbers(what, value, np.float32, _LIGHT)
    if taken.ndim == 3 and taken.shape[2] == 1:
        taken = taken[:, :, 0]
    if taken.ndim != 2 or not taken.size:
        raise ArrayError(f"{what}: an array of shape {taken.shape} is not one number a pixel. Give (height, width).")
    return taken


def _response(what: str, value: Any) -> bytes:
    """A table of light for codes evenly from 0 to the highest."""
    remedy = "Give a number, or light for codes evenly from 0 to the highest as (n,) or (n, 3)."
    taken = numbers(what, value, np.float64, remedy, kinds="fiu")
    if taken.ndim not in (1, 2) or taken.ndim == 2 and taken.shape[1] not in (1, 3):
        raise ArrayError(f"{what}: an array of shape {taken.shape} is no response. {remedy}")
    rows = taken.reshape(len(taken), -1).tolist()
    return "".join(",".join(map(repr, row)) + "\n" for row in rows).encode()


def toml(tables: Mapping[str, Any]) -> str:
    """The text of a scene file: a section for each table, one for each entry of a list of tables."""
    plain, sections = [], []
    for key, value in tables.items():
        if isinstance(value, Mapping):
            sections.append(_section(f"[{_key(key)}]", value))
        elif _is_tables(value):
            sections.extend(_section(f"[[{_key(key)}]]", entry) for entry in value)
        else:
            plain.append(f"{_key(key)} = {_value(key, value)}\n")
    return "\n".join(["".join(plain), *sections]).lstrip("\n")


def _section(head: str, table: Mapping[str, Any]) -> str:
    return head + "\n" + "".join(f"{_key(key)} = {_value(key, value)}\n" for key, value in table.items())


def _is_tables(value: Any) -> bool:
    return isinstance(value, Sequence) and bool(value) and all(isinstance(entry, Mapping) for entry in value)


def _key(key: object) -> str:
    if not isinstance(key, str):
        raise SceneError(f"{key!r}: is no key of a scene. Give words in quotes.")
    word = key
    bare = word != "" and word.isascii() and all(letter.isalnum() or letter in "-_" for letter in word)
    return word if bare else _string(word)


def _value(key: object, value: Any) -> str:
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, PathLike):
        value = fspath(value)
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(name)} = {_value(name, entry)}" for name, entry in value.items()) + " }"
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray)):
        return "[" + ", ".join(_value(key, entry) for entry in value) + "]"
    raise SceneError(
        f"{key}: a scene holds no {type(value).__name__}. Give a number, a word, a path, a list or a dictionary."
    )


def _string(words: str) -> str:
    if not encodable(words):
        raise SceneError(f"{words!r}: holds half of a character, which no scene file can. Give another name.")
    escaped = words.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(f"\\u{ord(c):04X}" if ord(c) < 32 or ord(c) == 127 else c for c in escaped) + '"'
