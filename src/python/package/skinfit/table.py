"""A table of results: a list of rows, each a dictionary."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any, overload

Row = dict[str, Any]

# Columns of names, which users give, and of settings.
_WORDS = {"scene", "view", "left_out", "axis", "setting", "unit", "effects", "name"}
# Python's own `int` and `float` take more, as `1_0`.
_WHOLE = re.compile(r"[+-]?[0-9]+")
_DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?inf|nan|NaN")


class Table(Sequence[Row]):
    """Rows with the same keys. `repr` shows them below one another; a notebook shows a table.

    >>> table = Table([{"view": "front", "psnr": 31.25}, {"view": "profile", "psnr": None}])
    >>> table
    view     psnr
    front    31.25
    profile
    >>> table.column("view")
    ['front', 'profile']
    """

    def __init__(self, rows: Iterable[Row]) -> None:
        self._rows = list(rows)

    @property
    def columns(self) -> list[str]:
        """The keys, in their order."""
        return list(dict.fromkeys(key for row in self._rows for key in row))

    def column(self, name: str) -> list[Any]:
        """The values of a key, row by row."""
        return [row.get(name) for row in self._rows]

    @overload
    def __getitem__(self, place: int) -> Row: ...

    @overload
    def __getitem__(self, place: slice) -> Table: ...

    def __getitem__(self, place: int | slice) -> Row | Table:
        return Table(self._rows[place]) if isinstance(place, slice) else self._rows[place]

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        lines = [self.columns, *([_words(row.get(name)) for name in self.columns] for row in self._rows)]
        widths = [max(len(line[i]) for line in lines) for i in range(len(self.columns))]
        return "\n".join("  ".join(c.ljust(w) for c, w in zip(line, widths)).rstrip() for line in lines)

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{escape(name)}</th>" for name in self.columns)
        cells = (
            "".join(f"<td>{escape(_words(row.get(name)))}</td>" for name in self.columns) for row in self._rows
        )
        rows = "".join(f"<tr>{row}</tr>" for row in cells)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def best(rows: Iterable[Row]) -> Any:
    """The rows as a pandas `DataFrame` where pandas is installed, else as a `Table`."""
    table = Table(rows)
    try:
        import pandas
    except ImportError:
        return table
    return pandas.DataFrame(list(table), columns=table.columns)


def read_csv(file: Path) -> list[Row]:
    """The rows of a file that the command line has left: numbers, `True`, `False`, `None` where it is empty, words.
    Columns of names and of settings are words, whatever they look like."""
    with file.open(newline="", encoding="utf-8") as lines:
        return [{name: _read(name, text) for name, text in row.items()} for row in csv.DictReader(lines)]


def _read(column: str, text: str) -> Any:
    if text in ("", "true", "false") and (column not in _WORDS or not text):
        return {"": None, "true": True, "false": False}[text]
    if column in _WORDS:
        return text
    if _WHOLE.fullmatch(text):
        return int(text)
    return float(text) if _DECIMAL.fullmatch(text) else text


def _words(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
