"""Scenes from files and from arrays, their images, and what is refused."""

import copy
import gc
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import skinfit
from skinfit.rendering import srgb

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
    assert srgb(np.array([-1.0, 0.0, 0.002, 0.5, 1.0, 2.0])).tolist() == [0, 0, 7, 188, 255, 255]
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
        ({"name": "\ud800"}, skinfit.SceneError, "half of a character"),
        ({"target": np.ones((24, 32, 3), dtype=np.uint8)}, skinfit.ArrayError, "front.target: holds integers .* undone"),
        ({"target": np.ones((24, 32, 3), dtype=complex)}, skinfit.ArrayError, "complex"),
        ({"target": np.full((24, 32), 1e39)}, skinfit.ArrayError, r"target\[0, 0\]: 1e\+39 is beyond what float32 holds"),
        ({"target": [[1.0], [1.0, 2.0]]}, skinfit.ArrayError, "view.front.target"),
        ({"target": np.zeros((0, 3))}, skinfit.ArrayError, "no image"),
        ({"target": np.ma.masked_less(np.zeros((24, 32)), 1)}, skinfit.ArrayError, "masked"),
        ({"target": None}, skinfit.ArrayError, "target"),
        ({"target": {"positions": []}}, skinfit.ArrayError, "target"),
        ({"mask": np.ones((24, 32), dtype=np.uint8)}, skinfit.ArrayError, "mask: holds integers .* truth values"),
        ({"haze": np.ones((24, 32, 3))}, skinfit.ArrayError, "one number a pixel"),
        ({"response": np.ones((2, 2))}, skinfit.ArrayError, "no response"),
    ],
)
def test_what_is_wrong_with_a_dictionary_is_told(
    change: dict[str, Any], kind: type[Exception], words: str, cache: Path
) -> None:
    with pytest.raises(kind, match=words):
        skinfit.load_dict(described(**change), cache=cache)


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"view": {"name": "front"}}, skinfit.SceneError, "view: is no list"),
        ({"view": ["front"]}, skinfit.SceneError, "view: is no list"),
        ({"model": {"terms": [{"names": ["a"]}]}}, skinfit.SceneError, "names no file"),
        ({"environment": {"file": np.ones((4, 8), dtype=np.uint8)}}, skinfit.ArrayError, "environment.file: holds int"),
        ({"environment": {"file": np.ones((4, 8), dtype=bool)}}, skinfit.ArrayError, "truth values"),
        ({"maps": {"normal": np.ones((4, 4, 3), dtype=np.uint16)}}, skinfit.ArrayError, r"lie in \[0, 1\]"),
        ({"maps": {"own": {"a/b": np.ones((4, 4), dtype=int)}}}, skinfit.ArrayError, "maps.own.a/b"),
        ({"maps": {"color": np.full((4, 4), np.nan)}}, skinfit.ArrayError, "maps.color.*is not finite"),
    ],
)
def test_what_is_wrong_with_a_table_is_told(
    change: dict[str, Any], kind: type[Exception], words: str, tmp_path: Path
) -> None:
    with pytest.raises(kind, match=words):
        skinfit.load_dict({**described(), **change}, folder=tmp_path)
    # Nothing half written stays.
    assert not list(tmp_path.iterdir())


def test_a_path_is_no_dictionary() -> None:
    with pytest.raises(skinfit.SceneError, match="call load_file"):
        skinfit.load_dict("scene.toml")  # type: ignore[arg-type]
    with pytest.raises(skinfit.SceneError, match="call load_dict"):
        skinfit.load_file({})  # type: ignore[arg-type]


def test_masks_haze_and_responses_are_arrays(cache: Path) -> None:
    light = np.full((24, 32, 3), 0.5)
    hazy = described(target=light, mask=np.ones((24, 32), dtype=bool), haze=light[:, :, 0])
    skinfit.load_dict({**hazy, "model": {"effects": ["diffuse", "haze"]}}, cache=cache)
    codes = {"name": "front", "response": np.float64(2.2)}
    # It holds light itself, not codes: the library has read the response.
    for response in (np.float64(2.2), np.linspace(0, 1, 5), np.ones((5, 3)) * np.linspace(0, 1, 5)[:, None]):
        with pytest.raises(skinfit.SceneError, match="holds light itself"):
            skinfit.load_dict(described(target=light, **{**codes, "response": response}), cache=cache)


def test_light_below_zero_is_a_scene_files(cache: Path) -> None:
    target = np.full((24, 32, 3), -0.5)
    skinfit.load_dict(described(target=target), cache=cache)
    with pytest.warns(skinfit.SkinfitWarning, match="negative radiance"):
        skinfit.load_dict({**described(), "environment": {"file": np.full((16, 32), -1.0)}}, cache=cache)


def test_views_whose_names_look_alike_have_files_of_their_own(cache: Path) -> None:
    whole = described()
    dark, bright = (np.full((24, 32, 3), value) for value in (0.1, 0.9))
    look = whole["view"][0]
    whole["view"] = [{**look, "name": "a.b", "target": dark}, {**look, "name": "a_b", "target": bright}]
    scene = skinfit.load_dict(whole, cache=cache)
    assert len(list(scene.path.parent.glob("*_target*.exr"))) == 2


def test_a_folder_with_another_scene_is_refused(cache: Path, tmp_path: Path) -> None:
    first = skinfit.load_dict(described(), folder=tmp_path / "kept", cache=cache)
    kept = {file.name: file.read_bytes() for file in first.path.parent.iterdir()}
    for other in (described(eye=[0.0, 0.0, 5.0]), {**described(), "environment": {"file": 2 * light()}}):
        with pytest.raises(skinfit.SceneError, match="another scene is in this folder"):
            skinfit.load_dict(other, folder=tmp_path / "kept", cache=cache)
    skinfit.load_dict(described(), folder=tmp_path / "kept", cache=cache)
    # One that is refused takes no place, nor anything from the one that is there.
    with pytest.raises(skinfit.SceneError, match="Did you mean `width`"):
        skinfit.load_dict(described(widht=3), folder=tmp_path / "other", cache=cache)
    assert not list((tmp_path / "other").iterdir())
    with pytest.raises(skinfit.SceneError, match="difuse"):
        skinfit.load_dict(described(), folder=tmp_path / "kept", effects="difuse", cache=cache)
    assert {file.name: file.read_bytes() for file in first.path.parent.iterdir()} == kept


def fitted_scene(cache: Path) -> skinfit.Scene:
    drawn = skinfit.load_dict(described(), cache=cache).render()
    target = np.concatenate([drawn.image, drawn.alpha[:, :, None]], axis=2)
    scene = skinfit.load_dict(described(target=target), cache=cache)
    scene.params["base_weight"] = 1.0
    return scene


def test_arrays_come_along_where_a_scene_is_saved(cache: Path, tmp_path: Path) -> None:
    scene = fitted_scene(cache)
    image, folder = scene.render().image, scene.path.parent
    scene.save(tmp_path / "one.toml")
    files = sorted(file.name for file in (tmp_path / "one_files").iterdir())
    scene.save(tmp_path / "one.toml")
    assert sorted(file.name for file in (tmp_path / "one_files").iterdir()) == files and len(files) == 4
    assert scene.copy().path == scene.path
    del scene
    gc.collect()
    assert not folder.exists()
    # Wherever it is moved to.
    moved = tmp_path.rename(tmp_path.with_name(tmp_path.name + "_moved"))
    again = skinfit.load_file(moved / "one.toml", cache=cache)
    assert again.params["base_weight"] == 1.0 and np.array_equal(again.render().image, image)


def test_arrays_come_along_where_a_fit_is_kept(cache: Path, tmp_path: Path, unwarned: None) -> None:
    scene = fitted_scene(cache)
    scene.fit(engine="cpu", run=tmp_path / "named", max_iterations=1)
    # Here it goes on as it began.
    found = scene.fit(engine="cpu", run=tmp_path / "named", resume=True, max_iterations=2)
    found.save(tmp_path / "saved")
    with scene.fit_steps(engine="cpu", solver="nelder-mead", run=tmp_path / "left") as steps:
        next(steps)
    with pytest.raises(skinfit.FileError, match="exists already"):
        found.save(tmp_path / "saved")
    folder = scene.path.parent
    del scene, found, steps
    gc.collect()
    assert not folder.exists()
    for run in ("named", "saved", "left"):
        code = f"import skinfit; print(skinfit.load_run({str(tmp_path / run)!r}).resume(max_iterations=50).params)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 0 and "0.6" in done.stdout, done.stderr
    assert sorted(file.name for file in tmp_path.iterdir()) == ["left", "named", "saved"]


def test_a_copy_has_values_of_its_own(small: skinfit.Scene, unwarned: None) -> None:
    small.params["hilite"] = (0.3, 0.2, 0.1)
    small.params.free_only("rim_weight", per_channel="hilite")
    small.params.bound("rim_weight", 0.0, 0.5)
    for other in (small.copy(), copy.copy(small), copy.deepcopy(small)):
        assert other.params.rows() == small.params.rows() and other.path == small.path
        other.params["hilite"] = 0.9
        other.params.fix()
        assert small.params["hilite"] == (0.3, 0.2, 0.1) and small.objective().names != []
    plain = skinfit.load_file(small.path, effects="diffuse")
    assert plain.copy().effects == plain.effects == ["diffuse"]
    with pytest.raises(TypeError, match="Pickle its path"):
        pickle.dumps(small)


def test_one_name_is_a_list_of_one(small: skinfit.Scene, scene: skinfit.Scene, unwarned: None) -> None:
    assert small.objective(hold_out="side").views == ["front"]
    assert list(small.fit(engine="cpu", hold_out="side", max_iterations=1).held_out) == ["side"]
    with pytest.raises(skinfit.ViewError, match="no name"):
        small.objective(hold_out=[3])  # type: ignore[list-item]
    with pytest.raises(skinfit.SceneError, match="no name"):
        skinfit.load_file(small.path, effects=[None])  # type: ignore[list-item]


def test_a_scene_that_goes_leaves_nothing_and_warns_of_nothing(cache: Path) -> None:
    scene = skinfit.load_dict(described(), cache=cache)
    folder = scene.path.parent
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        del scene
        gc.collect()
    assert not folder.exists() and not [w for w in heard if issubclass(w.category, ResourceWarning)]


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
    for wrong in (0, "\ud800"):
        with pytest.raises(skinfit.ViewError):
            scene.render(wrong)  # type: ignore[arg-type]
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
