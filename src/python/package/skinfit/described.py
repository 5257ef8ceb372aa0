"""A scene as a dictionary: its text as TOML, and its arrays as files beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from . import _native
from .errors import ArrayError, FileError, SceneError
from .mesh import glb

# Where a scene names files: of the tables these keys, of each view these.
_FILES = {
    "mesh": ("file",),
    "environment": ("file",),
    "maps": ("color", "normal", "specular", "attenuator"),
}
_OF_VIEW = ("target", "mask", "haze", "response")


def describe(scene: Mapping[str, Any], folder: Path) -> Path:
    """Write the scene as `scene.toml` in `folder`, with a file for each array: the scene's file."""
    writer = _Writer(folder)
    tables: dict[str, Any] = {}
    for key, value in scene.items():
        if key == "view":
            tables[key] = [writer.view(view) for view in value]
        elif isinstance(value, Mapping):
            tables[key] = writer.table(key, value)
        else:
            tables[key] = value
    text = toml(tables)
    file = folder / "scene.toml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(f"{file}: cannot be written: {error.strerror}. Name another folder.") from error
    return file


class _Writer:
    """Writes arrays into a folder, and gives the paths that stand for them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def table(self, name: str, table: Mapping[str, Any]) -> dict[str, Any]:
        written = dict(table)
        for key in _FILES.get(name, ()):
            if key in written:
                written[key] = self._file(f"{name}_{key}", written[key])
        if name == "model" and "terms" in written:
            written["terms"] = [self._term(term) for term in written["terms"]]
        own = written.get("own")
        if name == "maps" and isinstance(own, Mapping):
            written["own"] = {key: self._file(f"maps_own_{key}", value) for key, value in own.items()}
        return written

    def _term(self, term: Any) -> Any:
        """A file of rules, or a family's with its names."""
        if isinstance(term, Mapping):
            return {**term, "file": str(Path(term["file"]).absolute())}
        return str(Path(fspath(term)).absolute())

    def view(self, view: Mapping[str, Any]) -> dict[str, Any]:
        name = str(view.get("name", "view"))
        stem = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
        written = dict(view)
        for key in _OF_VIEW:
            if key in written and not isinstance(written[key], (int, float)):
                written[key] = self._file(f"view_{stem}_{key}", written[key])
        return written

    def _file(self, stem: str, value: Any) -> str:
        """The path of what a scene names: that of a file, or of one with these numbers."""
        if isinstance(value, (str, PathLike)):
            return str(Path(fspath(value)).absolute())
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            if isinstance(value, Mapping):
                path = self._folder / f"{stem}.glb"
                path.write_bytes(glb(value))
                return path.name
        except OSError as error:
            raise FileError(f"{self._folder}: cannot be written: {error.strerror}. Name another folder.") from error
        path = self._folder / f"{stem}.exr"
        _native.write_exr(path, image(stem, value))
        return path.name


def image(name: str, value: Any) -> np.ndarray[Any, np.dtype[np.float32]]:
    """An array as (height, width, 3 or 4) float32; one number a pixel becomes three."""
    numbers = np.asarray(value, dtype=np.float32)
    if numbers.ndim == 2:
        numbers = np.repeat(numbers[:, :, None], 3, axis=2)
    if numbers.ndim != 3 or numbers.shape[2] not in (3, 4):
        raise ArrayError(
            f"{name}: an array of shape {np.shape(value)} is no image. Give (height, width), (height, width, 3) or, with "
            "coverage, (height, width, 4)."
        )
    return np.ascontiguousarray(numbers)


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
    word = str(key)
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
    if isinstance(value, (str, PathLike)):
        return _string(fspath(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(name)} = {_value(name, entry)}" for name, entry in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(key, entry) for entry in value) + "]"
    raise SceneError(
        f"{key}: a scene holds no {type(value).__name__}. Give a number, a word, a path, a list or a dictionary."
    )


def _string(words: str) -> str:
    escaped = words.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(f"\\u{ord(c):04X}" if ord(c) < 32 or ord(c) == 127 else c for c in escaped) + '"'
