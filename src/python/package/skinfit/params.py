"""The parameters of a scene: a mapping from name to value, whose `repr` is the parameter table.

Names, defaults, bounds, units and what each does come from the library's own table; none of it stands here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union

import numpy as np
from numpy.typing import NDArray

from .errors import ParamError
from .given import Names, name, names, numbers

if TYPE_CHECKING:
    from . import _native

Freedom = Literal["fixed", "tied", "per_channel"]
"""What a fit may do to a parameter: nothing, move it as one, or move each channel."""

Value = Union[float, tuple[float, float, float]]
"""One number, or red, green and blue."""

Given = Union[float, "np.number[Any]", Sequence[float], "NDArray[Any]"]
"""What a parameter is set to: a number, or three."""


@dataclass(frozen=True)
class ParamInfo:
    """A row of the table."""

    name: str
    value: Value
    """The value that a fit starts from and an image is drawn with."""
    default: Value
    """The default of the scene's form of the model."""
    bounds: tuple[float, float]
    """Least and greatest value that a fit may give it."""
    limits: tuple[float, float]
    """Those of the model, which bounds lie within; infinite where there is none."""
    unit: str
    """Empty for a pure number."""
    free: Freedom
    rgb: bool
    """Whether it may have a value a channel."""
    linear: bool
    """Whether the image is linear in it."""
    owner: Literal["skin", "scene"]
    """Of several scenes that are fitted as one skin: whether all share it."""
    meaning: str
    source: str


class Params(MutableMapping[str, Value]):
    """The parameters that the scene's effects ask for.

    `params["hilite"]` is a float, or three where channels differ; `params["hilite"] = 0.5` and
    `params["hilite"] = (0.7, 0.6, 0.5)` set it. `free` and `fix` say what a fit moves, `info` has the whole row.
    A parameter that is set to three values and is free moves in each channel. Nothing can be removed. What is refused has
    changed nothing: of several names or values all are looked at first.

    >>> import skinfit
    >>> params = skinfit.demo().params
    >>> params["hilite"] = (0.7, 0.6, 0.5)
    >>> params.free_only("base_weight", per_channel=["hilite"])
    >>> [row.name for row in params.rows() if row.free != "fixed"]
    ['base_weight', 'hilite']
    >>> params.info("rim_exponent").bounds
    (0.25, 16.0)
    """

    def __init__(self, scene: _native.Scene) -> None:
        self._scene = scene

    def __getitem__(self, name: str) -> Value:
        """The value. Raises `ParamError` where the scene has no such parameter."""
        return self.info(name).value

    def __setitem__(self, name: str, value: Given) -> None:
        """Set it to one number, or to three. Raises `ParamError` where it may not have that value."""
        self._scene.set(_name(name), _numbers(name, value))

    def __delitem__(self, name: str) -> None:
        raise TypeError(f"{name}: parameters are the model's. Set one to its default instead: params.reset({name!r}).")

    def __iter__(self) -> Iterator[str]:
        return iter(row["name"] for row in self._scene.rows())

    def __len__(self) -> int:
        return len(self._scene.rows())

    def __contains__(self, name: object) -> bool:
        return any(row["name"] == name for row in self._scene.rows())

    def info(self, name: str) -> ParamInfo:
        """The whole row. Raises `ParamError` where the scene has no such parameter."""
        return _info(self._scene.row(_name(name)))

    def rows(self) -> list[ParamInfo]:
        """Every row, in the order of the table."""
        return [_info(row) for row in self._scene.rows()]

    def free(self, *names: str, per_channel: bool = False) -> None:
        """Have a fit move these: as one, or each channel. A parameter that becomes one takes the mean of its channels."""
        self._check(names, per_channel=per_channel)
        for name in names:
            self._scene.set_freedom(name, "per_channel" if per_channel else "tied")

    def fix(self, *names: str) -> None:
        """Have a fit leave these as they are; without names, all, those of effects that are off among them."""
        if not names:
            self._scene.fix_all()
        self._check(names)
        for name in names:
            self._scene.set_freedom(name, "fixed")

    def free_only(self, *names: str, per_channel: Names = ()) -> None:
        """Have a fit move these and nothing else; those in `per_channel`, one name or several, in each channel."""
        coloured = _names(per_channel)
        self._check(names)
        self._check(coloured, per_channel=True)
        self.fix()
        self.free(*names)
        self.free(*coloured, per_channel=True)

    def _check(self, names: Iterable[str], per_channel: bool = False) -> None:
        """Raise `ParamError` where one cannot be free, before any is."""
        for name in names:
            if per_channel and not self.info(name).rgb:
                # It refuses, and says why.
                self._scene.set_freedom(name, "per_channel")
            self.info(name)

    def bound(self, name: str, lower: float | None = None, upper: float | None = None) -> None:
        """Have a fit keep it from `lower` to `upper`, in each channel; with neither, within the model's limits. One that is left
        out is the model's, where that is finite. Raises `ParamError` where the model does not let it."""
        if lower is None and upper is None:
            self._scene.set_bounds(_name(name), None)
            return
        least, greatest = self.info(name).limits
        first = least if lower is None else _number(name, lower)
        self._scene.set_bounds(name, (first, greatest if upper is None else _number(name, upper)))

    def reset(self, *names: str) -> None:
        """Take the model's defaults for these; without names, for all."""
        defaults = {name: self.info(name).default for name in names or tuple(self)}
        self._set(defaults)

    def set_all(self, values: Mapping[str, Given]) -> None:
        """Take the values over, as `fit.params`, of this scene or of another.

        `SCENE/NAME`, as fits of several scenes have it, is taken where SCENE is this one's file or folder, before a plain
        `NAME`; those of other scenes are left out, as are parameters that no effect of this scene asks for. Raises
        `ParamError` for names that the model has not, and where one may not have that value.
        """
        if not isinstance(values, Mapping):
            raise ParamError(f"{values!r} is no mapping of names to values. Give a dictionary, as fit.params.")
        own = _called(Path(self._scene.path))
        plain, special = {}, {}
        for key, value in values.items():
            scene, _, name = _name(key).rpartition("/")
            if self._has(name):
                if not scene:
                    plain[name] = value
                elif scene in own:
                    special[name] = value
        self._set({**plain, **special})

    def _has(self, name: str) -> bool:
        """Whether one of the scene's effects asks for it. Raises `ParamError` where the model has none that is called so."""
        if self._scene.is_idle(name):
            return False
        self._scene.row(name)
        return True

    def _set(self, values: Mapping[str, Given]) -> None:
        """Set all of these, or none."""
        before = self._scene.rows()
        try:
            for name, value in values.items():
                self[name] = value
        except BaseException:
            self._restore(before)
            raise

    def _take(self, other: Params) -> None:
        """Take over values, bounds and what is free from a scene of the same file and effects."""
        rows = other._scene.rows()
        free = {name.partition(".")[0] for name in other._scene.free}
        if free <= {row["name"] for row in rows}:
            # What effects that are off would ask for was fixed there; of the file's it may be free.
            self._scene.fix_all()
        self._restore(rows)

    def _restore(self, rows: Sequence[_native._Row]) -> None:
        """Have rows as they were."""
        known = {row["name"]: row for row in self._scene.rows()}
        for was in rows:
            name = was["name"]
            # A file that was edited meanwhile may ask for others.
            if (now := known.get(name)) is None:
                continue
            if was["bounds"] != now["bounds"]:
                self._scene.set_bounds(name, None if was["bounds"] == was["limits"] else was["bounds"])
            if was["free"] != now["free"]:
                self._scene.set_freedom(name, was["free"])
            if was["value"] != self._scene.row(name)["value"]:
                value = value_of(was["value"])
                self._scene.set(name, list(value) if isinstance(value, tuple) else [value])

    def __repr__(self) -> str:
        rows = [_HEAD, *map(_cells, self.rows())]
        widths = [max(len(row[i]) for row in rows) for i in range(len(_HEAD))]
        lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{cell}</th>" for cell in _HEAD)
        rows = "".join(
            f'<tr title="{escape(row.meaning)}">' + "".join(f"<td>{escape(cell)}</td>" for cell in _cells(row)) + "</tr>"
            for row in self.rows()
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


_HEAD = ("name", "value", "default", "bounds", "unit", "free")


def _name(given: object) -> str:
    return name(given, ParamError)


def _names(given: Names) -> list[str]:
    return names(given, ParamError)


def _numbers(name: str, value: Given) -> list[float]:
    """One number, or more; how many there may be the library says."""
    remedy = "Give a number, or three of red, green and blue."
    taken = numbers(name, value, np.float64, remedy, kinds="fiu", finite=False, refused=ParamError)
    if taken.ndim > 1 or not taken.size:
        raise ParamError(f"{name}: an array of shape {taken.shape} is no value. {remedy}")
    return [float(number) for number in taken.reshape(-1)]


def _number(name: str, value: float) -> float:
    taken = _numbers(name, value)
    if len(taken) != 1:
        raise ParamError(f"{name}: a bound is one number, of every channel, and not {len(taken)}. Give one.")
    return taken[0]


def _called(file: Path) -> set[str]:
    """What a scene may be called among several: by its file, or by the folder of a `scene.toml`."""
    folder, own = file.absolute().parent.name, file.stem
    of_folder = own == "scene" and folder not in ("", "scenes")
    return {folder if of_folder else own, f"{folder}.{own}", own}


def value_of(given: float | Sequence[float]) -> Value:
    """One number, or three where channels differ."""
    if isinstance(given, (int, float)):
        return float(given)
    red, green, blue = map(float, given)
    return red if red == green == blue else (red, green, blue)


def _info(row: _native._Row) -> ParamInfo:
    lower, upper = row["bounds"]
    least, greatest = row["limits"]
    return ParamInfo(
        name=row["name"],
        value=value_of(row["value"]),
        default=value_of(row["default"]),
        bounds=(lower, upper),
        limits=(least, greatest),
        unit=row["unit"],
        free=row["free"],
        rgb=row["rgb"],
        linear=row["linear"],
        owner=row["owner"],
        meaning=row["meaning"],
        source=row["source"],
    )


def _cells(row: ParamInfo) -> tuple[str, ...]:
    lower, upper = row.bounds
    return (row.name, _words(row.value), _words(row.default), f"[{lower:g}, {upper:g}]", row.unit, row.free)


def _words(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else ", ".join(f"{number:.6g}" for number in value)
