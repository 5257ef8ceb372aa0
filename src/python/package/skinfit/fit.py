"""Fits: their steps, and what they have found.

A fit is the command line's, and leaves its run folder; a `Fit` is a view of such a folder, whoever has made it.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from .command import run as run_command
from .errors import Error, FitError, SkinfitWarning
from .html import framed
from .options import FitOptions, names_of, words_of
from .page import Page
from .page import write as write_page
from .params import Value
from .progress import Progress
from .running import Running, make_way
from .scratch import stays
from .study import copy
from .table import best

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .scene import Scene

FilePath = Union[str, "PathLike[str]"]
Ending = Literal["converged", "ran-out", "stalled", "interrupted"]


@dataclass(frozen=True)
class Step:
    """An iteration of a fit, and where it has led."""

    iteration: int
    """0 at the start."""
    evaluations: int
    """Passes over the samples so far."""
    loss: float
    seconds: float
    """Since the fit began."""
    constants: Mapping[str, Value]
    """The value of each parameter; of several scenes those of the first."""
    scenes: Sequence[Mapping[str, Value]]
    """The same of each scene."""


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
    """What a fit has found. `_repr_html_` is its report."""

    def __init__(
        self,
        run: Path,
        scenes: Sequence[Scene] | Callable[[], Sequence[Scene]],
        text: str = "",
        scratch: tempfile.TemporaryDirectory[str] | None = None,
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
        return {name: _value(param["value"]) for name, param in self.report["params"].items()}

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
        result = fit(self._scenes, callback, run=self.run, resume=True, hold_out=list(self.held_out), **options)
        result._scratch = self._scratch
        return result

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
            _warn(said.told)
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


class FitSteps(Iterator[Step]):
    """A fit under way, which waits after each step for the next one to be asked for. Whoever leaves the loop early asks for
    `result()`, for which the fit goes on to its end, or stops it before.

    Ctrl-C while a step is waited for stops it, and so does letting go of this. As a context manager it stops however it is
    left, also where Ctrl-C comes between two steps:

        with skinfit.fit_steps([scene]) as steps:
            for step in steps:
                print(step.loss)
        found = steps.result()
    """

    def __init__(self, running: Running, run: Path, scenes: Sequence[Scene], scratch: Any) -> None:
        self._running = running
        self._native = running.native
        self._run = run
        self._scenes = scenes
        self._scratch = scratch
        self.last: Step | None = None
        """The last step; `None` while the scenes are still read, baked and sampled."""

    def __next__(self) -> Step:
        """The next step. Raises what `result` raises where the fit was refused or failed."""
        with self._interrupted():
            self._running.taken()
            told = self._native.next()
            if told is None:
                raise StopIteration
            iteration, evaluations, loss, seconds, constants = told
            scenes = [{name: _value(rgb) for name, rgb in scene.items()} for scene in constants]
            step = self.last = Step(iteration, evaluations, loss, seconds, scenes[0], scenes)
        return step

    def __enter__(self) -> FitSteps:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        """Left without a result: it ends, and its folder stays until it has."""
        if not self._native.is_over:
            self.stop()
            with contextlib.suppress(RuntimeError):
                threading.Thread(target=_see_off, args=(self._native, self._scratch), daemon=True).start()

    def stop(self) -> None:
        """Have the fit end after the iteration that it is at, with what it has found and a state to be resumed. Before the first
        step nothing is found: `result` raises `FitError`."""
        self._running.stop()

    def close(self) -> None:
        """Stop, and wait until its folder holds what there is, unless nothing is there yet: then what was begun ends by itself.
        Once it is over this does nothing."""
        self.stop()
        if self.last is not None:
            # `result` raises it.
            with contextlib.suppress(Error):
                self._native.finish()

    def result(self) -> Fit:
        """Wait for its end: what it has found. Raises `FitError` where it was refused or failed, `ViewError` where `hold_out`
        names no view. Ctrl-C stops it; asked for again, this is what there is."""
        with self._interrupted():
            said, told = self._native.finish()
        _warn(told)
        if self._scratch is None:
            stays(self._run)
        return Fit(self._run, self._scenes, "\n".join(said), self._scratch)

    @contextlib.contextmanager
    def _interrupted(self) -> Iterator[None]:
        """Stop where Ctrl-C is heard."""
        try:
            yield
        except KeyboardInterrupt:
            self.stop()
            raise


def _see_off(native: _native.Fitting, scratch: Any) -> None:
    """Wait for a fit that nobody waits for; then its folder goes."""
    with contextlib.suppress(Exception):
        native.finish()
    del scratch


def fit_steps(
    scenes: Sequence[Scene],
    *,
    run: FilePath | None = None,
    resume: bool = False,
    hold_out: Sequence[str] = (),
    **options: Unpack[FitOptions],
) -> FitSteps:
    """Begin a fit, as `fit` does, and hand out its steps:

        steps = skinfit.fit_steps([scene])
        for step in steps:
            if step.loss < 1e-4:
                steps.stop()
        found = steps.result()

    A fit into the same folder that was stopped, or that this thread has left between two steps, is waited for.
    """
    given, held, words = _scenes(scenes), names_of(hold_out), words_of(options)
    if run is None and resume:
        raise FitError("a fit goes on in the folder that it was stopped in. Name it: run=...")
    if run is not None and not os.fspath(run):
        raise FitError("run = '' names no folder. Name one, or leave it out.")
    scratch = tempfile.TemporaryDirectory(prefix="skinfit-", ignore_cleanup_errors=True) if run is None else None
    place = Path(scratch.name) / "fit" if scratch is not None else Path(str(run))
    make_way(place)
    native = _native.Fitting([scene._native for scene in given], place, words, held, resume)
    return FitSteps(Running(native, place), place, given, scratch)


def _scenes(scenes: Sequence[Scene]) -> list[Scene]:
    """What is to be fitted: scenes, and at least one."""
    from .scene import Scene

    if isinstance(scenes, Scene) or not isinstance(scenes, Iterable):
        raise FitError(f"{scenes!r} is no list of scenes. Give one, as [skinfit.load_file(path)].")
    given = list(scenes)
    if not given:
        raise FitError("no scene is given. Give at least one, as [skinfit.load_file(path)].")
    for scene in given:
        if not isinstance(scene, Scene):
            raise FitError(f"{scene!r} is no scene. Give scenes, as skinfit.load_file(path).")
    return given


def fit(
    scenes: Sequence[Scene],
    callback: Callable[[Step], Any] | None = None,
    *,
    run: FilePath | None = None,
    resume: bool = False,
    hold_out: Sequence[str] = (),
    progress: bool | None = None,
    **options: Unpack[FitOptions],
) -> Fit:
    """Fit what is free of these scenes to their targets, several as one skin in different light, as `skinfit fit` does: the
    results are equal to the bit.

    - `callback` is called with each `Step`, and the fit goes on when it returns; `False` stops it there. What it raises ends
      the fit, and is raised here.
    - `run`: the run folder, by default one that goes with the `Fit`; `resume`: go on with the fit that was stopped there.
    - `hold_out`: views that are scored and not fitted; of several scenes also scenes, or `SCENE/VIEW`.
    - `progress`: whether a line shows how far it is, by default in a notebook and on a terminal.
    - `options`: see `FitOptions`.

    Ctrl-C stops the search after its iteration and keeps what there is: the `Fit` then is `interrupted`. Before the search,
    while scenes are read and baked, nothing is there to keep, and `KeyboardInterrupt` is raised, as it is by Ctrl-C a second
    time; what was begun then ends by itself, and a fit into the same folder waits for that. Python's lock is free meanwhile.
    Raises `FitError` and `SkinError` with the command line's paragraph, and `ViewError` where `hold_out` names no view. A fit
    that did not converge is no error: a `SkinfitWarning` says what to do.

    >>> import skinfit
    >>> found = skinfit.fit([skinfit.demo()], engine="cpu")
    >>> found.converged, round(found.params["base_weight"], 3)
    (True, 0.85)
    >>> sorted(found.scores)
    ['front', 'profile', 'three_quarter']
    """
    steps = fit_steps(scenes, run=run, resume=resume, hold_out=hold_out, **options)
    shown = Progress(progress)
    try:
        shown.begin()
        for step in steps:
            shown.step(step)
            if callback is not None and _is_false(callback(step)):
                steps.stop()
                break
    except KeyboardInterrupt:
        steps.stop()
        if steps.last is None:
            raise
    except BaseException:
        steps.stop()
        with contextlib.suppress(Exception):
            steps.result()
        raise
    finally:
        shown.close()
    return steps.result()


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


def _value(number: float | Sequence[float]) -> Value:
    if isinstance(number, (int, float)):
        return float(number)
    red, green, blue = map(float, number)
    return red if red == green == blue else (red, green, blue)


def _gain(view: str, found: Mapping[str, float]) -> Value:
    """A view's gain, which is one unknown, or one a channel."""
    whole = found.get(f"gain.{view}", 1.0)
    return _value([found.get(f"gain.{view}.{channel}", whole) for channel in "rgb"])


def _is_false(answer: object) -> bool:
    """Whether a callback says so; `None` does not."""
    return isinstance(answer, (bool, np.bool_)) and not answer


def _warn(told: Sequence[str]) -> None:
    for words in told:
        warnings.warn(words.removeprefix("warning: "), SkinfitWarning, stacklevel=4)
