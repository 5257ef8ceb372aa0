"""What fits have found.

A fit is the command line's, and leaves its run folder; a `Fit` is a view of such a folder, whoever has made it.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from .command import run as run_command
from .errors import FitError, warn
from .given import FilePath
from .html import framed
from .page import Page
from .page import write as write_page
from .params import Value, value_of
from .scratch import Scratch
from .study import copy
from .table import best

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .fit import Step
    from .options import FitOptions
    from .scene import Scene

Ending = Literal["converged", "ran-out", "stalled", "interrupted"]


@dataclass(frozen=True)
class Iteration:
    """An iteration, as the report has it."""

    iteration: int
    evaluations: int
    loss: float
    seconds: float


@dataclass(frozen=True)
class Scores:
    """How good a view is; `None` where no pixel of it is wholly covered."""

    psnr: float | None
    """dB."""
    ssim: float | None
    flip: float | None
    held_out: bool
    """Whether the fit has not seen it."""


class Fit:
    """What a fit has found. `_repr_html_` is its report.

    >>> import skinfit
    >>> found = skinfit.demo().fit(engine="cpu")
    >>> found.ending, len(found.history) > 3, found.gains["front"]
    ('converged', True, 1.0)
    """

    def __init__(
        self,
        run: Path,
        scenes: Sequence[Scene] | Callable[[], Sequence[Scene]],
        text: str = "",
        scratch: Scratch | None = None,
    ) -> None:
        self.run = run
        """The run folder."""
        self.report: dict[str, Any] = _report(run)
        """All numbers, as `report.json` has them."""
        self._read = scenes if callable(scenes) else lambda: scenes
        self._text = text
        # A run folder that goes with this.
        self._scratch = scratch

    @cached_property
    def _scenes(self) -> list[Scene]:
        return list(self._read())

    @property
    def ending(self) -> Ending:
        """How it ended. An interrupted fit, or one that ran out, can be resumed."""
        ending: Ending = self.report["ending"]
        return ending

    @property
    def converged(self) -> bool:
        """Whether it ended as it should."""
        return self.ending == "converged"

    @property
    def loss(self) -> float:
        """The loss at the end."""
        return float(self.report["loss"]["end"])

    @property
    def params(self) -> dict[str, Value]:
        """The value of each parameter that was free: `scene.params.set_all(fit.params)` takes them over. Of several scenes,
        what each has of its own is named `SCENE/NAME`."""
        return {name: value_of(param["value"]) for name, param in self.report["params"].items()}

    @property
    def gains(self) -> dict[str, Value]:
        """The factor on each view's image, which is 1 unless the scene frees gains: `scene.render(view).image * fit.gains[view]`
        is the image that was fitted. `Fit.params` has none of these."""
        found = {unknown["name"]: float(unknown["value"]) for unknown in self.report["unknowns"]}
        return {view: _gain(view, found) for view in self.report["views"]}

    @property
    def std_errors(self) -> dict[str, float | None]:
        """One standard error of each unknown (a parameter, a channel as `hilite.r`, a gain as `gain.left`), in the
        parameter's unit; `None` at a bound, and where the images do not determine it."""
        return {unknown["name"]: unknown["std_error"] for unknown in self.report["unknowns"]}

    @property
    def unknowns(self) -> Any:
        """A table with a row for each unknown: start, value, standard errors, bounds, whether it ended on one."""
        return best(self.report["unknowns"])

    @property
    def correlations(self) -> tuple[list[str], NDArray[np.float64]]:
        """The unknowns' names, and their (K, K) correlations; NaN beside an unknown without a standard error."""
        found = self.report["correlations"]
        matrix = np.array(found["matrix"], dtype=np.float64).reshape(len(found["names"]), len(found["names"]))
        return list(found["names"]), matrix

    @property
    def undetermined(self) -> list[dict[str, float]]:
        """Directions in which the images do not tell constants apart: each a unit vector, unknown to component."""
        return [dict(direction) for direction in self.report["undetermined"]]

    @property
    def history(self) -> list[Iteration]:
        """The loss after each iteration; the first is the start."""
        return [Iteration(**iteration) for iteration in self.report["history"]]

    @property
    def scores(self) -> dict[str, Scores]:
        """How good each view is, held-out ones among them."""
        views = self.report["views"].items()
        return {name: Scores(of["psnr"], of["ssim"], of["flip"], of["held_out"]) for name, of in views}

    @property
    def held_out(self) -> dict[str, Scores]:
        """How good the views are that the fit has not seen."""
        return {name: scores for name, scores in self.scores.items() if scores.held_out}

    @property
    def warnings(self) -> list[str]:
        """What the report warns of."""
        return list(self.report["warnings"])

    @property
    def html(self) -> str:
        """The report's page."""
        return (self.run / "report.html").read_text(encoding="utf-8")

    def save(self, folder: FilePath) -> Path:
        """Copy the run folder, with the report and what `resume` and `skinfit render --params` take, to one that is not
        there yet. Raises `FileError`."""
        return copy(self.run, Path(folder))

    def resume(self, callback: Callable[[Step], Any] | None = None, **options: Unpack[FitOptions]) -> Fit:
        """Go on from where it stopped, in the same folder, with its solver, starts and seed; `max_iterations` counts from
        the first start. Raises `FitError` where the scenes were changed since."""
        from .fit import begin, ended

        steps = begin(self._scenes, self.run, self._scratch, True, list(self.held_out), options)
        return ended(steps, callback, None)

    def export(
        self,
        to: str,
        file: FilePath | None = None,
        *,
        constants: bool = False,
        material: str | None = None,
    ) -> str:
        """The constants with their shader for another engine (`skinfit export --to`), or `constants` alone: the text, which
        is written to `file`, too, if one is named. Raises `FitError`."""
        words = ["export", str(self.run / "params.toml"), "--to", to, *(["--constants"] if constants else [])]
        if material is not None:
            words += ["--material", material]
        with tempfile.TemporaryDirectory(prefix="skinfit-") as scratch:
            place = Path(file) if file is not None else Path(scratch) / "export"
            said = run_command([*words, "-o", str(place)], FitError)
            warn(said.told)
            return place.read_text(encoding="utf-8")

    def page(self, file: FilePath | None = None, *, player: FilePath | None = None, title: str | None = None) -> Page:
        """The fit as a page for a browser, with sliders, images and fits (`skinfit page`): one file that needs nothing else,
        by default `page.html` in the run folder, which the report links to. It holds the scene's files: whoever has it has
        these. `player`: see `skinfit.page`. Raises `FileError`."""
        place = Path(file) if file is not None else self.run / "page.html"
        cache = self._scenes[0]._cache_words() if self._scenes else []
        words = [str(self.run), *cache, *([] if title is None else [f"--title={title}"])]
        return write_page(words, place, player, self._scratch)

    def __reduce__(self) -> tuple[Callable[[FilePath], Fit], tuple[Path]]:
        """Pickled by its run folder, which has to be there where it is read again."""
        if self._scratch is not None:
            raise TypeError("this fit's folder goes with it, so it cannot be pickled. Save it first: load_run(fit.save(folder)).")
        return load_run, (self.run.absolute(),)

    def __repr__(self) -> str:
        if self._text:
            return self._text
        values = "; ".join(f"{unknown['name']} = {unknown['value']:.6g}" for unknown in self.report["unknowns"])
        return f"Fit({self.ending}, loss {self.loss:.6e}: {values})"

    def _repr_html_(self) -> str:
        return framed(self.html)


def load_run(folder: FilePath) -> Fit:
    """What a run folder of `skinfit fit`, or of `Fit.save`, holds. Raises `FitError` where it is none."""
    from .scene import load_file

    run = Path(folder)
    report = _report(run)
    several = [file for file in report["files"] if file.startswith("scenes/") and file.endswith(".toml")]
    # Read where they are asked for: what was found stands without the files that they name.
    return Fit(run, lambda: [load_file(run / file) for file in several or ["scene.toml"]])


def _report(run: Path) -> dict[str, Any]:
    file = run / "report.json"
    try:
        report = json.loads(file.read_bytes())
    except (OSError, ValueError) as error:
        raise FitError(f"{file}: this is not the folder of a fit: {error}. Name the run folder of one.") from error
    if not isinstance(report, dict) or "unknowns" not in report:
        raise FitError(f"{file}: this is no report of a fit. Name the run folder of one.")
    return report


def _gain(view: str, found: Mapping[str, float]) -> Value:
    """A view's gain, which is one unknown, or one a channel."""
    whole = found.get(f"gain.{view}", 1.0)
    return value_of([found.get(f"gain.{view}.{channel}", whole) for channel in "rgb"])
