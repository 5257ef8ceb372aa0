"""Scenes from files and from arrays, their images, and what is refused."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import skinfit

from conftest import Program, grid, light


def test_an_image_is_the_command_lines_to_the_bit(
    scene: skinfit.Scene, demo_file: Path, cache: Path, program: Program, tmp_path: Path
) -> None:
    file = tmp_path / "front.exr"
    words = ["--view", "front", "--engine", "cpu", "--cache", cache, "-o", file]
    program("render", demo_file, "--set", "rim_exponent=3", "--set", "hilite=0.2", *words)
    scene.params["rim_exponent"] = 3
    # Once with other weights, so that what drew these draws the next.
    scene.render("front")
    scene.params["hilite"] = 0.2
    drawn = scene.render("front", terms=True)
    with OpenEXR.File(str(file), separate_channels=True) as read:
        channels = read.channels()
        for place, name in enumerate("RGB"):
            assert np.array_equal(channels[name].pixels, drawn.image[:, :, place])
        assert np.array_equal(channels["A"].pixels, drawn.alpha)
    whole = sum(layer.astype(np.float64) for layer in drawn.layers.values())
    assert "hilite" in drawn.layers and np.allclose(whole, drawn.image, atol=1e-5)
    assert drawn.image.dtype == np.float32 and drawn.srgb().dtype == np.uint8


def described(**view: Any) -> dict[str, Any]:
    look = {"name": "front", "eye": [0.0, 0.0, 4.0], "look_at": [0.0, 0.0, 0.0], "fov_y_degrees": 40.0}
    return {
        "mesh": {"file": grid()},
        "environment": {"file": light()},
        "maps": {"color": np.full((4, 4, 3), 0.5)},
        "model": {"effects": ["diffuse"], "params": {"base_weight": 0.6}},
        "view": [{**look, "width": 32, "height": 24, **view}],
        "fit": {"free": ["base_weight"]},
    }


def test_a_scene_of_arrays_is_drawn_and_fitted(cache: Path, tmp_path: Path) -> None:
    drawn = skinfit.load_dict(described(), cache=cache).render()
    assert drawn.image.shape == (24, 32, 3) and drawn.alpha.max() == 1.0
    target = np.concatenate([drawn.image, drawn.alpha[:, :, None]], axis=2)
    scene = skinfit.load_dict(described(target=target, mask=np.ones((24, 32))), folder=tmp_path / "kept", cache=cache)
    scene.params["base_weight"] = 1.0
    found = scene.fit(engine="cpu")
    assert found.params["base_weight"] == pytest.approx(0.6, abs=1e-5)
    # What was kept is a scene like any other.
    again = skinfit.load_file(tmp_path / "kept" / "scene.toml", cache=cache)
    assert np.array_equal(again.render().image, drawn.image)


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"target": np.ones((24, 32, 5))}, skinfit.ArrayError, "no image"),
        ({"target": np.ones((3, 3, 3))}, skinfit.SceneError, "target"),
        ({"width": "wide"}, skinfit.SceneError, "line 19: invalid type: string"),
        ({"widht": 3}, skinfit.SceneError, "Did you mean `width`"),
        ({"eye": object()}, skinfit.SceneError, "eye"),
    ],
)
def test_what_is_wrong_with_a_dictionary_is_told(
    change: dict[str, Any], kind: type[Exception], words: str, cache: Path
) -> None:
    with pytest.raises(kind, match=words):
        skinfit.load_dict(described(**change), cache=cache)


def test_what_is_wrong_with_a_mesh_is_told(cache: Path) -> None:
    whole = described()
    for mesh, words in [
        ({**grid(), "positions": np.ones((4, 2))}, "positions"),
        ({**grid(), "triangles": [[0, 1, 99]]}, "beyond"),
        ({**grid(), "uvs": np.full((64, 2), np.nan)}, "finite"),
        ({**grid(), "colours": []}, "colours"),
    ]:
        with pytest.raises(skinfit.ArrayError, match=words):
            skinfit.load_dict({**whole, "mesh": {"file": mesh}}, cache=cache)


def test_a_refusal_is_the_command_lines_paragraph(program: Program, tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text('[mesh]\nfile = "nothing.glb"\n[[view]]\nnam = "front"\n')
    told = program("fit", file, "-o", tmp_path / "run", code=2).stderr
    with pytest.raises(skinfit.SceneError) as refused:
        skinfit.load_file(file)
    assert told == f"skinfit: {refused.value}\n"
    with pytest.raises(skinfit.Error):
        skinfit.load_file(tmp_path / "nothing.toml")


def test_a_view_that_there_is_not_is_a_view_error(scene: skinfit.Scene) -> None:
    with pytest.raises(skinfit.ViewError, match="there is no view `behind`"):
        scene.render("behind")
    with pytest.raises(skinfit.ViewError):
        scene.objective(hold_out=["behind"])
    with pytest.raises(skinfit.SceneError, match="difuse"):
        skinfit.load_file(scene.path, effects=["difuse"])


def test_other_effects_are_read_where_they_are_named(small: skinfit.Scene, cache: Path, unwarned: None) -> None:
    plain = skinfit.load_file(small.path, effects=["diffuse", "hilite"], cache=cache)
    assert plain.effects == ["diffuse", "hilite"] and "rim_weight" not in plain.params
    assert not np.array_equal(plain.render().image, small.render().image)


def test_what_was_mended_is_a_warning(cache: Path, demo_file: Path) -> None:
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        skinfit.load_file(demo_file, cache=cache)
    assert not heard
