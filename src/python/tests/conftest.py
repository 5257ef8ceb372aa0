"""What the tests share: the built-in scene, and the command line in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import skinfit

Program = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def demo_file(cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built-in scene's file, which no test changes."""
    return skinfit.demo(tmp_path_factory.mktemp("demo"), cache=cache).path


@pytest.fixture(scope="session")
def adapter() -> None:
    """What asks for it needs a graphics adapter."""
    if os.environ.get("SKINFIT_NO_GPU_TESTS"):
        pytest.skip("NOT CHECKED: SKINFIT_NO_GPU_TESTS is set")


@pytest.fixture
def scene(demo_file: Path, cache: Path) -> skinfit.Scene:
    return skinfit.load_file(demo_file, cache=cache)


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
def unwarned() -> Iterator[None]:
    """What is warned of is no error here."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", skinfit.SkinfitWarning)
        yield
