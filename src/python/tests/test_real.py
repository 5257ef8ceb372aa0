"""Scenes of a scanned head, which are not part of the project: fits and images are the command line's to the bit."""

import os
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import skinfit

from conftest import NotChecked, Program, numbers, report_of

# They share one head, and so what is baked of it.
SCENES = ["lps_forest", "lps_sunrise"]


def real(name: str, not_checked: NotChecked) -> Path:
    """A scene's file. Without the data this fails, unless `SKINFIT_NO_DATA_TESTS` allows it; then it says so."""
    data = Path(os.environ.get("SKINFIT_DATA") or Path(__file__).resolve().parents[4] / "shared/data")
    file = data / name / "scene.toml"
    if not file.is_file():
        missing = f"{file} is missing: SKINFIT_DATA names the folder of the real scenes"
        assert os.environ.get("SKINFIT_NO_DATA_TESTS"), f"{missing}; SKINFIT_NO_DATA_TESTS=1 leaves these tests out."
        not_checked(f"{missing}, and SKINFIT_NO_DATA_TESTS is set")
        pytest.skip(missing)
    return file


@pytest.mark.parametrize("name", SCENES)
def test_a_fit_of_a_real_scene_is_the_command_lines_to_the_bit(
    name: str, cache: Path, program: Program, tmp_path: Path, not_checked: NotChecked, unwarned: None
) -> None:
    file = real(name, not_checked)
    # Few iterations of one view: enough for every bit to count, and quick.
    words = ["--engine", "cpu", "--max-iterations", 2, "--hold-out", "profile", "--hold-out", "threequarter"]
    program("fit", file, "-o", tmp_path, "--cache", cache, *words, code=1)
    scene = skinfit.load_file(file, cache=cache)
    found = scene.fit(engine="cpu", max_iterations=2, hold_out=["profile", "threequarter"])
    assert found.ending == "ran-out"
    assert numbers(found.report) == numbers(report_of(tmp_path))


def test_an_image_of_a_real_scene_is_the_command_lines_to_the_bit(
    cache: Path, program: Program, tmp_path: Path, not_checked: NotChecked
) -> None:
    file = real(SCENES[0], not_checked)
    program("render", file, "--view", "front", "--engine", "cpu", "--cache", cache, "-o", tmp_path / "front.exr")
    drawn = skinfit.load_file(file, cache=cache).render("front")
    with OpenEXR.File(str(tmp_path / "front.exr"), separate_channels=True) as read:
        channels = read.channels()
        for place, channel in enumerate("RGB"):
            assert np.array_equal(channels[channel].pixels, drawn.image[:, :, place])
        assert np.array_equal(channels["A"].pixels, drawn.alpha)
