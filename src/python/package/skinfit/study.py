"""Studies of the command line: what each part is worth, what accuracy costs, and whether every evaluator is stable.

Each runs in a process of its own and leaves a folder, which `Study` is a view of.

    >>> import skinfit
    >>> study = skinfit.demo().tradeoff(axes=["filter"])
    >>> list(study.plots), {row["axis"] for row in study.rows()}
    (['filter'], {'filter'})
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from .command import run as run_command
from .errors import FileError, StudyError, warn
from .given import FilePath, Names, names
from .html import framed
from .scratch import Scratch, copy_run, named_or_own, stays
from .table import Row, best, read_csv

if TYPE_CHECKING:
    from .scene import Scene

Gpu = Literal["auto", "always", "never"]


class AblateOptions(TypedDict, total=False):
    """Those of `ablate`."""

    run: FilePath | None
    pairs: bool
    refit: bool
    params: FilePath | None
    hold_out: Names
    gpu: Gpu


class TradeoffOptions(TypedDict, total=False):
    """Those of `tradeoff`."""

    run: FilePath | None
    axes: Names
    params: FilePath | None
    hold_out: Names
    within: float | None
    budget: float | None


class StabilityOptions(TypedDict, total=False):
    """Those of `stability`."""

    run: FilePath | None
    cases: int
    seed: int
    pixels: int
    replay: FilePath | None
    gpu: bool


class Study:
    """What a study has found, and its folder."""

    def __init__(self, run: Path, text: str, failed: bool, scratch: Scratch | None) -> None:
        self.run = run
        """Its folder: results, pictures and the report, as the command line leaves them."""
        self.failed = failed
        """Whether it has results that are not all that was asked for, as where a fit did not converge; a warning says which."""
        self._text = text
        # A folder that goes with this.
        self._scratch = scratch

    @property
    def table(self) -> Any:
        """The results: a pandas `DataFrame` where pandas is installed, else a `Table` (a list of dictionaries). Columns are
        those of `results.csv`; of a study of stability a row for each evaluator and case."""
        return best(self.rows())

    def rows(self) -> list[Row]:
        """The same rows as plain dictionaries."""
        stable = self.run / "stability.json"
        return _stability_rows(json.loads(stable.read_bytes())) if stable.is_file() else read_csv(self.run / "results.csv")

    @property
    def plots(self) -> dict[str, str]:
        """Each plot by its name, as SVG."""
        return {file.stem: file.read_text(encoding="utf-8") for file in sorted(self.run.glob("*.svg"))}

    def save(self, folder: FilePath) -> Path:
        """Copy the study's folder to one that is not there yet. Raises `FileError`."""
        return copy(self.run, Path(folder))

    def __repr__(self) -> str:
        return self._text

    def _repr_html_(self) -> str:
        report = self.run / "report.html"
        if report.is_file():
            return framed(report.read_text(encoding="utf-8"))
        table = best(self.rows())
        return str(table._repr_html_())


def ablate(
    scenes: Iterable[Scene],
    *,
    run: FilePath | None = None,
    pairs: bool = False,
    refit: bool = False,
    params: FilePath | None = None,
    hold_out: Names = (),
    gpu: Gpu = "auto",
) -> Study:
    """Leave each effect and term out in turn: what the images lose, and what is saved (`skinfit ablate`).

    `pairs`: two at a time, too; `refit`: fit what is left again; `params`: constants of an earlier fit, a `params.toml`;
    `hold_out`: views that no fit sees, one or several; `gpu`: whether the renderer is timed. Results go into the folder
    `run`, by default one that goes with the `Study`. Raises `StudyError`.
    """
    words = [*_flag("--pairs", pairs), *_flag("--refit", refit), *_option("--params", params)]
    return _study("ablate", scenes, run, [*words, *_each("--hold-out", hold_out), "--gpu", gpu])


def tradeoff(
    scenes: Iterable[Scene],
    *,
    run: FilePath | None = None,
    axes: Names = (),
    params: FilePath | None = None,
    hold_out: Names = (),
    within: float | None = None,
    budget: float | None = None,
) -> Study:
    """Sweep each approximation, error beside cost (`skinfit tradeoff`).

    `axes`: those to sweep, one or several, by default every one; `within`: name the cheapest settings that are off by no
    more than this share together, as 0.005; `budget`: the most accurate ones that take no longer than this number of seconds. The rest as of
    `ablate`. `Study.plots` has a plot for each axis.
    """
    share = None if within is None else f"{100.0 * within:.12g}%"
    seconds = None if budget is None else f"{budget:.12g}s"
    words = [*_each("--axis", axes), *_option("--params", params), *_each("--hold-out", hold_out)]
    return _study("tradeoff", scenes, run, [*words, *_option("--within", share), *_option("--budget", seconds)])


def stability(
    scenes: Iterable[Scene],
    *,
    run: FilePath | None = None,
    cases: int = 1000,
    seed: int = 0,
    pixels: int = 1_000_000,
    replay: FilePath | None = None,
    gpu: bool = True,
) -> Study:
    """Try hard cases on every evaluator, and search for new ones (`skinfit stability`).

    `cases`: random ones, drawn from `seed`; `pixels`: of the case that sums over many; `replay`: cases of an earlier study;
    `gpu`: whether a graphics adapter is tried. `Study.failed` says whether a case failed.
    """
    counts = ["--cases", str(cases), "--seed", str(seed), "--pixels", str(pixels)]
    return _study("stability", scenes, run, [*counts, *_option("--replay", replay), *_flag("--no-gpu", not gpu)])


def copy(folder: Path, to: Path) -> Path:
    """Copy a run folder to a place where nothing is yet, whole or not at all. Files that go with a scene come along."""
    if to.exists():
        raise FileError(f"{to}: the run cannot be copied there: it exists already. Name another folder.")
    try:
        to.absolute().parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".skinfit-", dir=to.absolute().parent) as beside:
            copied = Path(beside) / "run"
            copy_run(folder, to, copied)
            return copied.rename(to)
    except OSError as error:
        raise FileError(f"{to}: the run cannot be copied there: {error.strerror or error}. Name another folder.") from error


def _study(command: str, given: Iterable[Scene], run: FilePath | None, words: Sequence[str]) -> Study:
    from .scene import scenes_of

    scenes = scenes_of(given, StudyError)
    place, scratch = named_or_own(run, command)
    if scratch is None:
        stays(place, [scene._folder for scene in scenes])
    with tempfile.TemporaryDirectory(prefix="skinfit-") as changed:
        files = [str(scene._file(Path(changed) / str(i))) for i, scene in enumerate(scenes)]
        said = run_command([command, *files, "-o", str(place), *scenes[0]._cache_words(), *words], StudyError)
    if said.failed and not any(place.glob("*.json")):
        raise StudyError("\n".join(said.told))
    warn(said.told)
    return Study(place, said.out, said.failed, scratch)


def _stability_rows(report: dict[str, Any]) -> list[Row]:
    rows: list[Row] = []
    for engine in report["engines"]:
        for case in engine["cases"]:
            rows.append({"evaluator": engine["name"], "search": "hard", "tried": None, "failed": None, **case})
        for search in ("random", "lights", "scene"):
            tally = engine[search]
            worst = {"name": search, "hard": None, **tally["worst"]}
            rows.append(
                {"evaluator": engine["name"], "search": search, "tried": tally["tried"], "failed": tally["failed"], **worst}
            )
    return rows


def _flag(name: str, on: bool) -> list[str]:
    return [name] if on else []


def _option(name: str, value: object) -> list[str]:
    return [] if value is None else [f"{name}={value}"]


def _each(name: str, values: Names) -> list[str]:
    return [f"{name}={value}" for value in names(values, StudyError)]
