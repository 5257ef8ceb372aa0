"""Fits are the command line's to the bit; they can be watched, stopped and resumed."""

import pickle
import sys
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest
import skinfit
from skinfit.progress import _in_notebook

from conftest import Program, numbers, report_of


def test_a_fit_is_the_command_lines_to_the_bit(
    fitted: skinfit.Fit, demo_file: Path, cache: Path, program: Program, tmp_path: Path
) -> None:
    program("fit", demo_file, "-o", tmp_path, "--cache", cache, "--engine", "cpu")
    assert numbers(fitted.report) == numbers(report_of(tmp_path))
    assert fitted.converged and fitted.loss < 1e-6


def test_changed_values_are_those_of_the_command_lines_words(
    small: skinfit.Scene, cache: Path, program: Program, tmp_path: Path
) -> None:
    small.params["rim_exponent"] = 3
    small.params["hilite"] = (0.6, 0.5, 0.4)
    small.params.free_only("base_weight", "rim_exponent", per_channel=["hilite"])
    words = ["--set", "rim_exponent=3", "--set", "hilite=0.6,0.5,0.4", "--free", "base_weight,rim_exponent,hilite"]
    program("fit", small.path, "-o", tmp_path, "--cache", cache, "--engine", "cpu", "--solver", "lm", *words)
    found = small.fit(engine="cpu", solver="lm")
    assert numbers(found.report)["unknowns"] == numbers(report_of(tmp_path))["unknowns"]
    assert list(found.std_errors) == ["base_weight", "rim_exponent", "hilite.r", "hilite.g", "hilite.b"]


def test_a_fit_stays_within_the_bounds_that_are_set(
    scene: skinfit.Scene, cache: Path, program: Program, tmp_path: Path
) -> None:
    scene.params.free_only("base_weight", "rim_exponent")
    scene.params.bound("base_weight", 0.5, 0.7)
    assert scene.params.info("base_weight").bounds == (0.5, 0.7)
    scene.params["base_weight"] = 0.6
    found = scene.fit(engine="cpu", run=tmp_path / "run")
    # Without them it ends at 0.74.
    assert found.params["base_weight"] == 0.7 and found.std_errors["base_weight"] is None
    assert scene.objective().bounds[0] == (0.5, 0.7)
    # The folder's scene file holds them for the command line.
    program("fit", tmp_path / "run" / "scene.toml", "-o", tmp_path / "again", "--cache", cache, "--engine", "cpu")
    assert numbers(report_of(tmp_path / "again"))["unknowns"] == numbers(found.report)["unknowns"]
    with pytest.raises(skinfit.ParamError, match="out of bounds"):
        scene.objective().loss([0.9, 2.0])
    scene.params.bound("base_weight", 0.5, 0.65)
    with pytest.raises(skinfit.FitError, match="other bounds"):
        scene.fit(run=tmp_path / "run", resume=True)
    with pytest.raises(skinfit.ParamError, match="no such interval"):
        scene.params.bound("base_weight", 0.8, 0.5)
    scene.params.bound("base_weight")
    info = scene.params.info("base_weight")
    assert info.bounds == info.limits


def test_what_is_found_stands_in_the_fit(fitted: skinfit.Fit, tmp_path: Path) -> None:
    assert fitted.params["base_weight"] == pytest.approx(0.85, abs=1e-5)
    names, matrix = fitted.correlations
    assert matrix.shape == (len(names), len(names)) and np.allclose(np.diag(matrix)[~np.isnan(np.diag(matrix))], 1)
    assert fitted.history[0].iteration == 0 and fitted.history[-1].loss == fitted.loss
    assert "<iframe" in fitted._repr_html_() and "base_weight" in repr(fitted)
    saved = fitted.save(tmp_path / "kept")
    again = skinfit.load_run(saved)
    assert again.report == fitted.report and again.params == fitted.params
    with pytest.raises(skinfit.FileError):
        fitted.save(tmp_path / "kept")


def test_held_out_views_are_scored_and_not_fitted(small: skinfit.Scene) -> None:
    found = small.fit(engine="cpu", hold_out=["side"])
    assert list(found.held_out) == ["side"]
    assert not found.scores["front"].held_out
    with pytest.raises(skinfit.ViewError, match="nobody"):
        small.fit(hold_out=["nobody"])


def test_each_step_is_told_and_false_stops(small: skinfit.Scene) -> None:
    steps: list[skinfit.Step] = []

    def watch(step: skinfit.Step) -> bool:
        steps.append(step)
        return len(steps) < 2

    with pytest.warns(skinfit.SkinfitWarning, match="interrupted"):
        found = small.fit(watch, engine="cpu")
    assert found.ending == "interrupted" and len(steps) == 2
    assert set(steps[0].constants) == set(small.params)


def test_numpys_false_stops_and_nothing_does_not(small: skinfit.Scene, unwarned: None) -> None:
    assert small.fit(lambda step: np.False_, engine="cpu").ending == "interrupted"
    assert small.fit(lambda step: None, engine="cpu").converged


def test_a_refusal_is_raised_by_whoever_asks_for_steps(small: skinfit.Scene, tmp_path: Path) -> None:
    with pytest.raises(skinfit.ViewError, match="nobody"):
        list(small.fit_steps(hold_out=["nobody"]))
    steps = small.fit_steps(engine="cpu", device_memory=1)
    for _ in range(2):
        with pytest.raises(skinfit.FitError, match="device_memory"):
            next(steps)
    with pytest.raises(skinfit.FitError, match="device_memory"):
        steps.result()


def test_a_folder_without_a_name_is_refused(small: skinfit.Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(skinfit.FitError, match="names no folder"):
        small.fit(run="")
    assert not list(tmp_path.iterdir())


def test_fitted_gains_are_those_of_the_images(small_file: Path, cache: Path) -> None:
    file = small_file.with_name("gains.toml")
    file.write_text(small_file.read_text(encoding="utf-8").replace("[fit]\n", "[fit]\ngains = true\n"), encoding="utf-8")
    looks = skinfit.load_file(file, cache=cache)
    f = looks.objective()
    found = looks.fit(engine="cpu")
    assert list(found.gains) == ["front", "side"] and found.gains["front"] == 1.0
    assert found.gains["side"] == found.report["unknowns"][f.names.index("gain.side")]["value"]
    looks.params.set_all(found.params)
    side = looks.render("side")
    x = [unknown["value"] for unknown in found.report["unknowns"]]
    assert np.allclose(side.image * found.gains["side"], f.image(x, "side"), atol=1e-5)


def test_gains_of_channels_are_three_numbers(fitted: skinfit.Fit, tmp_path: Path) -> None:
    again = skinfit.load_run(fitted.save(tmp_path / "kept"))
    channels = [{"name": f"gain.profile.{channel}", "value": value} for channel, value in [("r", 1.5), ("g", 1.0), ("b", 0.5)]]
    again.report["unknowns"] = channels
    assert again.gains == {"front": 1.0, "three_quarter": 1.0, "profile": (1.5, 1.0, 0.5)}


def test_a_fit_is_pickled_by_its_folder(small: skinfit.Scene, tmp_path: Path) -> None:
    found = small.fit(engine="cpu", run=tmp_path / "run")
    again = pickle.loads(pickle.dumps(found))
    assert again.params == found.params and again.run == found.run
    with pytest.raises(TypeError, match="Save it first"):
        pickle.dumps(small.fit(engine="cpu"))


def test_a_fit_that_is_left_stops_and_frees_its_folder(small: skinfit.Scene, tmp_path: Path, unwarned: None) -> None:
    with small.fit_steps(run=tmp_path / "run", engine="cpu") as steps:
        next(steps)
    assert steps.result().ending == "interrupted"
    # One that nobody holds any more.
    next(small.fit_steps(run=tmp_path / "run", engine="cpu"))
    # One that this thread has left between two steps.
    left = small.fit_steps(run=tmp_path / "run", engine="cpu")
    next(left)
    assert small.fit(run=tmp_path / "run", engine="cpu").converged
    # One that is wanted is in the way.
    wanted = small.fit_steps(run=tmp_path / "run", engine="cpu")
    thread = threading.Thread(target=lambda: next(wanted))
    thread.start()
    thread.join()
    with pytest.raises(skinfit.FitError, match="another run is writing"):
        small.fit(run=tmp_path / "run", engine="cpu")
    assert wanted.result().converged


def test_progress_is_shown_from_the_beginning(small: skinfit.Scene, capsys: pytest.CaptureFixture[str]) -> None:
    small.fit(engine="cpu", progress=True)
    lines = capsys.readouterr().err.split("\r")
    assert "read, baked and sampled" in lines[1] and "iterations" in lines[2]


def test_colabs_shell_is_a_notebooks(monkeypatch: pytest.MonkeyPatch) -> None:
    class ZMQInteractiveShell:
        pass

    class Shell(ZMQInteractiveShell):
        pass

    ipython = types.ModuleType("IPython")
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    for shell, shown in [(Shell(), True), (ZMQInteractiveShell(), True), (None, False), (object(), False)]:
        monkeypatch.setattr(ipython, "get_ipython", lambda shell=shell: shell, raising=False)
        assert _in_notebook() is shown


def test_a_stopped_fit_goes_on_to_the_same_bits(small: skinfit.Scene, tmp_path: Path, unwarned: None) -> None:
    whole = small.fit(engine="cpu")
    steps = small.fit_steps(run=tmp_path / "run", engine="cpu")
    next(steps)
    next(steps)
    steps.stop()
    stopped = steps.result()
    assert stopped.ending == "interrupted"
    found = stopped.resume(engine="cpu")
    assert found.converged and found.params == whole.params and found.loss == whole.loss
    small.params["rim_exponent"] = 3
    small.params.fix("rim_exponent")
    with pytest.raises(skinfit.FitError, match="other free constants"):
        small.fit(run=tmp_path / "run", resume=True)


def test_what_a_callback_raises_ends_the_fit_and_is_raised(small: skinfit.Scene, tmp_path: Path, unwarned: None) -> None:
    class Enough(Exception):
        pass

    def watch(step: skinfit.Step) -> None:
        raise Enough

    with pytest.raises(Enough):
        small.fit(watch, run=tmp_path / "run", engine="cpu")
    # It has ended: its folder is whole, and free for the next.
    assert skinfit.load_run(tmp_path / "run").ending == "interrupted"
    assert small.fit(run=tmp_path / "run", engine="cpu").converged


def test_several_scenes_are_fitted_as_one_skin(
    small: skinfit.Scene, cache: Path, program: Program, tmp_path: Path
) -> None:
    files = [tmp_path / "noon.toml", tmp_path / "night.toml"]
    for file in files:
        small.save(file)
    both = [skinfit.load_file(file, cache=cache) for file in files]
    found = skinfit.fit(both, engine="cpu")
    program("fit", *files, "-o", tmp_path / "run", "--cache", cache, "--engine", "cpu")
    assert numbers(found.report)["unknowns"] == numbers(report_of(tmp_path / "run"))["unknowns"]
    assert "noon/front" in found.scores
    with pytest.raises(skinfit.SkinError, match="named twice"):
        skinfit.fit([both[0], both[0]])


@pytest.mark.timed
def test_other_threads_go_on_while_a_fit_runs(scene: skinfit.Scene) -> None:
    count, over = 0, threading.Event()

    def tick() -> None:
        nonlocal count
        while not over.is_set():
            count += 1
            time.sleep(1e-3)

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.monotonic()
    scene.fit(engine="cpu")
    seconds, ticks = time.monotonic() - begun, count
    over.set()
    thread.join()
    # A lock that is held lets it tick in between alone, some tens of times.
    assert ticks > 50 * seconds, (ticks, seconds)
