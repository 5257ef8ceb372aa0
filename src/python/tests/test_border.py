"""What crosses the border between Python and the library, and what does not: panics, forks, options, many threads."""

import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skinfit
from skinfit import _native


@pytest.mark.parametrize("place", ["call", "work"])
def test_a_panic_is_a_fault(place: Any) -> None:
    with pytest.raises(skinfit.Fault, match="a panic on purpose. This is a fault of skinfit's"):
        _native._panic(place)


def test_a_panic_of_a_fits_thread_is_a_fault_and_the_next_fit_goes_well(small: skinfit.Scene, tmp_path: Path) -> None:
    _native._panic("fit")
    with pytest.raises(skinfit.Fault, match="a panic on purpose"):
        small.fit(engine="cpu", run=tmp_path / "run")
    assert small.fit(engine="cpu", run=tmp_path / "run").converged


_FORKED = """
    import os, sys
    import skinfit
    scene = skinfit.load_file({scene!r}, cache={cache!r})
    scene.render()
    steps = scene.fit_steps(engine="cpu")
    next(steps)
    child = os.fork()
    if child == 0:
        for work in (scene.render, scene.fit, lambda: next(steps)):
            try:
                work()
            except skinfit.Error as error:
                print(error, flush=True)
        os._exit(0)
    os.waitpid(child, 0)
    steps.close()
    print("parent", scene.render().image.shape, flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="nothing forks there")
def test_a_forked_child_is_refused_instead_of_waiting_for_ever(small_file: Path, cache: Path) -> None:
    script = textwrap.dedent(_FORKED.format(scene=str(small_file), cache=str(cache)))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    *child, parent = done.stdout.splitlines()
    assert len(child) == 3 and all("spawn" in line for line in child), done.stderr
    assert parent == "parent (40, 48, 3)"


def test_threads_that_share_a_fits_steps_take_turns(small: skinfit.Scene) -> None:
    steps = small.fit_steps(engine="cpu", solver="nelder-mead", max_iterations=40)
    taken: list[int] = []
    failures: list[BaseException] = []

    def take() -> None:
        try:
            taken.extend(step.iteration for step in steps)
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=take) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert not failures and not any(thread.is_alive() for thread in threads)
    assert sorted(taken) == list(range(len(taken))) and len(taken) > 8


def test_everything_is_fixed_in_one_call(small_file: Path, cache: Path, unwarned: None) -> None:
    # The file frees constants of effects that are off here.
    plain = skinfit.load_file(small_file, effects=["diffuse"], cache=cache)._native
    assert "rim_weight" in plain.free
    plain.fix_all()
    assert plain.free == []


def test_the_command_lines_words_are_pythons() -> None:
    told = "error: invalid value '-1' for '--starts <N>': -1 is not in 1..=10000\n\nFor more information, try '--help'.\n"
    assert _native.in_python(told) == "invalid value '-1' for 'starts': -1 is not in 1..=10000"
    told = "/a--seed/--starts: `skinfit fit --resume` goes on; --adapter or --engine cpu, not --adapters. Choose with -o."
    assert _native.in_python(told) == (
        "/a--seed/--starts: `skinfit fit --resume` goes on; adapter or engine cpu, not --adapters. Choose with run."
    )


_NO_LIST: list[Callable[[skinfit.Scene], Any]] = [
    lambda scene: [],
    lambda scene: None,
    lambda scene: [None],
    lambda scene: [scene, "scene.toml"],
    lambda scene: scene,
]


@pytest.mark.parametrize("given", _NO_LIST)
def test_what_is_no_list_of_scenes_is_refused_at_once(given: Callable[[skinfit.Scene], Any], small: skinfit.Scene) -> None:
    for work in (skinfit.fit, skinfit.fit_steps):
        with pytest.raises(skinfit.FitError, match="Give"):
            work(given(small))


@pytest.mark.parametrize(
    ("option", "value", "takes"),
    [
        ("starts", -1, "starts = -1: it takes a whole number from 1 to 10000."),
        ("starts", True, "starts = True"),
        ("seed", 1.5, "seed = 1.5: it takes a whole number from 0 on."),
        ("max_iterations", "x", "max_iterations = 'x': it takes a whole number from 1 on."),
        ("solver", "newton", "solver = 'newton': it takes 'varpro' or 'lm'"),
        ("loss", "l3", "loss = 'l3': it takes 'l2'"),
        ("engine", "tpu", "engine = 'tpu': it takes 'auto' or 'cpu' or 'gpu'."),
        ("samples", "auto", "samples = 'auto': it takes 'cpu' or 'gpu'."),
        ("adapter", 3, "adapter = 3: it takes a str."),
        ("device_memory", -2, "device_memory = -2"),
        ("verify", "yes", "verify = 'yes': it takes True or False."),
    ],
)
def test_an_option_is_refused_in_pythons_words(option: str, value: Any, takes: str, small: skinfit.Scene) -> None:
    with pytest.raises(skinfit.FitError) as refused:
        small.fit_steps(**{option: value})
    assert str(refused.value).startswith(takes) and "--" not in str(refused.value)


def test_options_take_numbers_of_numpys_and_none(small: skinfit.Scene) -> None:
    options: Any = {"starts": np.int64(1), "max_iterations": None, "verify": np.bool_(False)}
    found = small.fit(engine="cpu", **options)
    assert found.converged


def test_what_the_command_line_refuses_is_told_in_pythons_words(small: skinfit.Scene) -> None:
    with pytest.raises(skinfit.FitError, match="^adapter says how") as refused:
        small.fit(engine="cpu", adapter="none")
    assert "--" not in str(refused.value)


def test_what_a_study_refuses_is_told_in_pythons_words(small: skinfit.Scene) -> None:
    when: Any = "often"
    with pytest.raises(skinfit.StudyError, match="^invalid value 'often' for 'gpu'") as refused:
        small.ablate(gpu=when)
    assert "--" not in str(refused.value)


def test_names_that_are_held_out_are_names_of_views(small: skinfit.Scene) -> None:
    name: Any = 3
    with pytest.raises(skinfit.ViewError, match="3 is neither a name"):
        small.fit(hold_out=name)
    with pytest.raises(skinfit.ViewError, match="nothing is left"):
        small.fit(hold_out=["front", "side"])


def test_a_scene_that_cannot_be_written_is_a_file_error(small: skinfit.Scene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(skinfit.FileError, match="file"):
        small.save(tmp_path / "file" / "scene.toml")


@pytest.mark.timed
def test_an_image_takes_no_slopes(scene: skinfit.Scene) -> None:
    f = scene.objective()

    def seconds(work: Callable[[], object]) -> float:
        begun = time.perf_counter()
        work()
        return time.perf_counter() - begun

    along = np.ones(len(f.names))
    # Slopes by a dozen constants take longer than the image.
    image, product = (min(seconds(work) for _ in range(5)) for work in (lambda: f.image(f.start), lambda: f.jvp(f.start, along)))
    assert image < 0.75 * product


def test_a_direction_is_finite(small: skinfit.Scene) -> None:
    f = small.objective()
    with pytest.raises(skinfit.ArrayError, match="rim_weight by NaN"):
        f.jvp(f.start, [0.0, np.nan, *[0.0] * (len(f.names) - 2)])
