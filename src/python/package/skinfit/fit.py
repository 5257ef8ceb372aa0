"""Fits and their steps. What one has found is a `Fit`."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from .errors import Error, FitError, ViewError, warn
from .found import Fit
from .given import FilePath, Names, names
from .options import FitOptions, words_of
from .params import Value, value_of
from .progress import Progress
from .running import Running, make_way
from .scratch import Scratch, named_or_own, stays

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .scene import Scene


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

    def __init__(self, running: Running, run: Path, scenes: Sequence[Scene], scratch: Scratch | None) -> None:
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
            scenes = [{name: value_of(rgb) for name, rgb in scene.items()} for scene in constants]
            step = self.last = Step(iteration, evaluations, loss, seconds, scenes[0], scenes)
        return step

    def __enter__(self) -> FitSteps:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        """Left without a result: it ends, and its folder stays until it has."""
        if self._native.is_over:
            return
        self.stop()
        # At the end of the process no thread begins any more, and before it one is waited for that will end soon.
        if not sys.is_finalizing():
            left = (self._running, self._scratch)
            threading.Thread(target=_see_off, args=left, daemon=self.last is None).start()

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
        warn(told)
        return Fit(self._run, self._scenes, "\n".join(said), self._scratch)

    @contextlib.contextmanager
    def _interrupted(self) -> Iterator[None]:
        """Stop where Ctrl-C is heard."""
        try:
            yield
        except KeyboardInterrupt:
            self.stop()
            raise


def _see_off(running: Running, scratch: Scratch | None) -> None:
    """Wait for a fit that nobody waits for; then its folder goes."""
    with contextlib.suppress(Exception):
        running.native.finish()
    del scratch


def fit_steps(
    scenes: Sequence[Scene],
    *,
    run: FilePath | None = None,
    resume: bool = False,
    hold_out: Names = (),
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
    if run is None and resume:
        raise FitError("a fit goes on in the folder that it was stopped in. Name it: run=...")
    if run is not None and not os.fspath(run):
        raise FitError("run = '' names no folder. Name one, or leave it out.")
    place, scratch = named_or_own(run, "fit")
    return begin(scenes, place, scratch, resume, hold_out, options)


def begin(
    scenes: Sequence[Scene],
    run: Path,
    scratch: Scratch | None,
    resume: bool,
    hold_out: Names,
    options: FitOptions,
) -> FitSteps:
    """Begin a fit in `run`, which goes with `scratch`, if with any."""
    from .scene import scenes_of

    given, held, words = scenes_of(scenes, FitError), names(hold_out, ViewError), words_of(options)
    make_way(run)
    if scratch is None:
        stays(run, [scene._folder for scene in given])
    native = _native.Fitting([scene._native for scene in given], run, words, held, resume)
    return FitSteps(Running(native, run), run, given, scratch)


def fit(
    scenes: Sequence[Scene],
    callback: Callable[[Step], Any] | None = None,
    *,
    run: FilePath | None = None,
    resume: bool = False,
    hold_out: Names = (),
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
    return ended(fit_steps(scenes, run=run, resume=resume, hold_out=hold_out, **options), callback, progress)


def ended(steps: FitSteps, callback: Callable[[Step], Any] | None, progress: bool | None) -> Fit:
    """What a fit has found once it has ended, told of step by step."""
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


def _is_false(answer: object) -> bool:
    """Whether a callback says so; `None` does not."""
    return isinstance(answer, (bool, np.bool_)) and not answer
