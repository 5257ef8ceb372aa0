"""What the tests share: the built-in scene, and the command line in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skinfit
from numpy.typing import NDArray

Program = Callable[..., "subprocess.CompletedProcess[str]"]
NotChecked = Callable[[str], None]


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where bakes are kept: what the notebook and studies take too, so that the built-in scene is baked once."""
    kept = os.environ.get("SKINFIT_CACHE")
    return Path(kept) if kept else tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def demo_file(cache: Path) -> Path:
    """The built-in scene's file, which no test changes."""
    return skinfit.demo(cache=cache).path


@pytest.fixture(scope="session")
def adapter() -> None:
    """What asks for it needs a graphics adapter."""
    if os.environ.get("SKINFIT_NO_GPU_TESTS"):
        pytest.skip("NOT CHECKED: SKINFIT_NO_GPU_TESTS is set")


@pytest.fixture
def scene(demo_file: Path, cache: Path) -> skinfit.Scene:
    return skinfit.load_file(demo_file, cache=cache)


def grid(side: int = 8) -> dict[str, NDArray[Any]]:
    """A square of two by two that faces +Z, its middle bulging."""
    places = np.linspace(-1.0, 1.0, side)
    x, y = np.meshgrid(places, places)
    positions = np.stack([x, y, 0.2 * np.cos(x) * np.cos(y)], axis=-1).reshape(-1, 3)
    uvs = np.stack([(x + 1) / 2, (1 - y) / 2], axis=-1).reshape(-1, 2)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, 1, side], corner + [1, side + 1, side]])
    return {"positions": positions, "triangles": triangles, "uvs": uvs}


def light() -> NDArray[np.float64]:
    """A panorama that is brighter to one side, in one colour more than in others."""
    return np.linspace(0.5, 1.5, 32)[None, :, None] * np.ones((16, 32, 1)) * [1.0, 0.9, 0.8]


@pytest.fixture(scope="session")
def small_file(cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene of two views that takes no time: its targets are its own model's at other values."""
    folder = tmp_path_factory.mktemp("small")
    side = {"look_at": [0.0, 0.0, 0.0], "fov_y_degrees": 40.0, "width": 48, "height": 40}
    looks: dict[str, Any] = {
        "mesh": {"file": grid()},
        "environment": {"file": light()},
        "maps": {"color": np.full((4, 4, 3), 0.5)},
        "model": {"effects": ["diffuse", "rim", "hilite"]},
        "view": [{"name": "front", "eye": [0.0, 0.0, 4.0], **side}, {"name": "side", "eye": [3.0, 1.0, 1.5], **side}],
        "fit": {"free": ["base_weight", "rim_weight", "rim_exponent", "hilite"]},
    }
    drawn = skinfit.load_dict(looks, cache=cache)
    drawn.params.set_all({"base_weight": 0.8, "rim_weight": 0.3, "rim_exponent": 2.5, "hilite": (0.5, 0.4, 0.3)})
    for view in looks["view"]:
        image = drawn.render(view["name"])
        view["target"] = np.concatenate([image.image, image.alpha[:, :, None]], axis=2)
    return skinfit.load_dict(looks, folder=folder, cache=cache).path


@pytest.fixture
def small(small_file: Path, cache: Path) -> skinfit.Scene:
    return skinfit.load_file(small_file, cache=cache)


@pytest.fixture(scope="session")
def program(cache: Path) -> Program:
    """The command line: its words, and which exit code it is to have."""

    def run(*words: object, code: int = 0) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "skinfit", *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        assert done.returncode == code, done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def fitted(demo_file: Path, cache: Path) -> skinfit.Fit:
    """A fit of the built-in scene by the CPU."""
    return skinfit.load_file(demo_file, cache=cache).fit(engine="cpu")


def numbers(report: dict[str, Any]) -> dict[str, Any]:
    """What of a report depends on neither time nor place."""
    kept = ["loss", "params", "views", "scores", "solver", "iterations", "evaluations", "ending", "unknowns"]
    kept += ["errors", "profile", "correlations", "undetermined", "misfit", "samples"]
    history = [(step["iteration"], step["evaluations"], step["loss"]) for step in report["history"]]
    return {**{key: report[key] for key in kept}, "history": history}


def report_of(run: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads((run / "report.json").read_bytes())
    return report


@pytest.fixture
def not_checked(capfd: pytest.CaptureFixture[str]) -> NotChecked:
    """Say on standard error what is left out, past what keeps a passing test quiet."""

    def say(words: str) -> None:
        with capfd.disabled():
            print(f"\nNOT CHECKED: {words}", file=sys.stderr, flush=True)

    return say


@pytest.fixture
def unwarned() -> Iterator[None]:
    """What is warned of is no error here."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", skinfit.SkinfitWarning)
        yield
