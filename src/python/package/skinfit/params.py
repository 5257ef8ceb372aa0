"""The parameters of a scene: a mapping from name to value, whose `repr` is the parameter table.

Names, defaults, bounds, units and what each does come from the library's own table; none of it stands here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Literal, Union

if TYPE_CHECKING:
    from . import _native

Freedom = Literal["fixed", "tied", "per_channel"]
"""What a fit may do to a parameter: nothing, move it as one, or move each channel."""

Value = Union[float, tuple[float, float, float]]
"""One number, or red, green and blue."""


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
    A parameter that is set to three values and is free moves in each channel. Nothing can be removed.

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

    def __setitem__(self, name: str, value: float | Sequence[float]) -> None:
        """Set it to one number, or to three. Raises `ParamError` where it may not have that value."""
        self._scene.set(name, _numbers(value))

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
        return _info(self._scene.row(name))

    def rows(self) -> list[ParamInfo]:
        """Every row, in the order of the table."""
        return [_info(row) for row in self._scene.rows()]

    def free(self, *names: str, per_channel: bool = False) -> None:
        """Have a fit move these: as one, or each channel. A parameter that becomes one takes the mean of its channels."""
        for name in names:
            self._scene.set_freedom(name, "per_channel" if per_channel else "tied")

    def fix(self, *names: str) -> None:
        """Have a fit leave these as they are; without names, all."""
        for name in names or tuple(self):
            self._scene.set_freedom(name, "fixed")

    def free_only(self, *names: str, per_channel: Sequence[str] = ()) -> None:
        """Have a fit move these and nothing else; those in `per_channel` in each channel."""
        self.fix()
        self.free(*names)
        self.free(*per_channel, per_channel=True)

    def bound(self, name: str, lower: float | None = None, upper: float | None = None) -> None:
        """Have a fit keep it from `lower` to `upper`, in each channel; with neither, within the model's limits. One that is left
        out is the model's, where that is finite. Raises `ParamError` where the model does not let it."""
        if lower is None and upper is None:
            self._scene.set_bounds(name, None)
            return
        least, greatest = self.info(name).limits
        self._scene.set_bounds(name, (least if lower is None else lower, greatest if upper is None else upper))

    def reset(self, *names: str) -> None:
        """Take the model's defaults for these; without names, for all."""
        for name in names or tuple(self):
            self[name] = self.info(name).default

    def set_all(self, values: Mapping[str, float | Sequence[float]]) -> None:
        """Take those of the values that the scene has a parameter for, as `fit.params` of another scene."""
        for name in self:
            if name in values:
                self[name] = values[name]

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


def _numbers(value: float | Sequence[float]) -> list[float]:
    try:
        return [float(value)]  # type: ignore[arg-type]
    except TypeError:
        return [float(number) for number in value]  # type: ignore[union-attr]


def _value(rgb: Sequence[float]) -> Value:
    red, green, blue = rgb
    return red if red == green == blue else (red, green, blue)


def _info(row: _native._Row) -> ParamInfo:
    lower, upper = row["bounds"]
    least, greatest = row["limits"]
    return ParamInfo(
        name=row["name"],
        value=_value(row["value"]),
        default=_value(row["default"]),
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
