"""Gradients with respect to maps and light, against differences, and images and losses against the processor's."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skinfit
from numpy.typing import NDArray

pytestmark = pytest.mark.usefixtures("adapter")

SKIN = ("color", "specular", "attenuator", "occlusion")


def of_light(file: Path, cache: Path) -> skinfit.Scene:
    """The built-in scene, of which the environment is a map: its texels hold what the lobe does to it."""
    scene = skinfit.load_file(file, cache=cache)
    scene.params.fix("specular_lobe")
    return scene


@pytest.fixture(scope="module", params=["skin", "light"])
def both(request, demo_file, cache) -> tuple[skinfit.MapObjective, skinfit.Objective]:  # type: ignore[no-untyped-def]
    """A function of maps, and the same of constants alone."""
    if request.param == "skin":
        scene = skinfit.load_file(demo_file, cache=cache)
        return scene.map_objective(*SKIN), scene.objective()
    scene = of_light(demo_file, cache)
    return scene.map_objective("environment"), scene.objective()


def moved(f: skinfit.MapObjective, name: str, change: Any) -> dict[str, NDArray[np.float32]]:
    return {name: (f.maps[name] + change).astype(np.float32)}


def test_maps_have_names_shapes_and_bounds(both: tuple[skinfit.MapObjective, skinfit.Objective]) -> None:
    f, constants = both
    assert f.names == constants.names and f.bounds == constants.bounds and f.views == constants.views
    assert np.array_equal(f.start, constants.start)
    maps = f.maps
    assert list(maps) in (list(SKIN), ["irradiance", "lobe", "hilite"]) and list(f.map_bounds) == list(maps)
    for name, array in maps.items():
        ends = {"color": (3,), "irradiance": (4,), "lobe": (4,), "hilite": (4,)}.get(name, ())
        assert array.dtype == np.float32 and (array.shape[-1:] == ends or array.ndim in (1, 2)), name
    assert f.adapter in repr(f)


def test_at_the_start_images_losses_and_slopes_are_the_processors(
    both: tuple[skinfit.MapObjective, skinfit.Objective]
) -> None:
    f, constants = both
    x = f.start
    for view in f.views:
        # Some ten roundings of 6e-8 of radiances of about 1.
        assert np.allclose(f.image(x, view=view), constants.image(x, view), atol=2e-6), view
    assert f.loss() == pytest.approx(constants.loss(x), rel=1e-5)
    loss, gradients = f.loss_and_gradient()
    assert loss == f.loss() == f.loss(x, f.maps)
    wanted = constants.gradient(x)
    # Sums of 32 bits over some 100,000 pixels, in both.
    assert np.abs(gradients.constants - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_the_image_is_the_drawn_one(both: tuple[skinfit.MapObjective, skinfit.Objective], demo_file, cache) -> None:  # type: ignore[no-untyped-def]
    drawn = skinfit.load_file(demo_file, cache=cache).render("profile").image
    assert np.allclose(both[0].image(view="profile"), drawn, atol=1e-5)


def test_the_gradient_is_that_of_the_loss(both: tuple[skinfit.MapObjective, skinfit.Objective]) -> None:
    f, _ = both
    _, gradients = f.loss_and_gradient()
    for name, gradient in gradients.maps.items():
        assert gradient.shape == f.maps[name].shape
        largest = np.abs(gradient).max()
        assert largest > 0.0, name
        # Single numbers, those that count most: pixels that do not see them are the same to the bit, so that little is
        # rounded away. The loss is no square, so that the step leaves its square behind.
        step = 0.01 * max(1.0, float(np.abs(f.maps[name]).mean()))
        for place in np.argsort(-np.abs(gradient), axis=None)[:2]:
            change = np.zeros_like(gradient)
            change.flat[place] = step
            difference = (f.loss(maps=moved(f, name, change)) - f.loss(maps=moved(f, name, -change))) / (2 * step)
            assert difference == pytest.approx(gradient.flat[place], rel=0.02), (name, place)
        # All at once, along the gradient.
        along = gradient / largest * step
        difference = (f.loss(maps=moved(f, name, along)) - f.loss(maps=moved(f, name, -along))) / 2
        assert difference == pytest.approx(float(np.sum(along * gradient, dtype=np.float64)), rel=0.02), name


def test_products_of_the_jacobian_are_those_of_the_image(both: tuple[skinfit.MapObjective, skinfit.Objective]) -> None:
    f, constants = both
    random = np.random.default_rng(3)
    view = "three_quarter"
    image = f.image(view=view)
    weights = random.normal(size=image.shape)
    found = f.vjp(None, None, weights, view)
    wanted = constants.vjp(f.start, weights, view)
    assert np.abs(found.constants - wanted).max() < 1e-4 * np.abs(wanted).max()
    for name, gradient in found.maps.items():
        # The image is linear in each map: the step may be as large as a map is. Its roundings, 6e-8 each, are as many as
        # its numbers, and independent.
        along = (0.5 * f.maps[name].mean() * random.normal(size=gradient.shape)).astype(np.float32)
        pair = [f.image(maps=moved(f, name, sign * along), view=view).astype(np.float64) for sign in (1, -1)]
        difference = np.sum(weights * (pair[0] - pair[1])) / 2
        product = np.sum(gradient.astype(np.float64) * along)
        size = np.linalg.norm(gradient) * np.linalg.norm(along)
        assert abs(difference - product) < 1e-4 * size, name


@pytest.mark.parametrize("loss", ["l2", "huber", "smape"])
def test_other_losses_and_free_gains_are_those_of_the_processor(
    loss: str, demo_file: Path, cache: Path, tmp_path: Path
) -> None:
    skinfit.load_file(demo_file, cache=cache).save(tmp_path / "saved.toml")
    text = (tmp_path / "saved.toml").read_text(encoding="utf-8")
    assert 'loss = "relative_l2"' in text
    file = tmp_path / "scene.toml"
    file.write_text(text.replace('loss = "relative_l2"', f'loss = "{loss}"\ngains = true'), encoding="utf-8")
    scene = skinfit.load_file(file, cache=cache)
    f, constants = scene.map_objective("color", hold_out=["profile"]), scene.objective(hold_out=["profile"])
    x = constants.start
    gain = f.names.index("gain.three_quarter")
    x[gain] = 1.1
    assert f.loss(x) == pytest.approx(constants.loss(x), rel=1e-5)
    wanted = constants.gradient(x)
    found = f.loss_and_gradient(x)[1]
    assert np.abs(found.constants - wanted).max() < 1e-3 * np.abs(wanted).max() and wanted[gain] != 0.0
    assert np.allclose(f.image(x, view="three_quarter"), constants.image(x, "three_quarter"), atol=2e-6)
    weights = np.ones_like(f.image(x))
    products, wanted = f.vjp(x, None, weights, "three_quarter"), constants.vjp(x, weights, "three_quarter")
    assert np.abs(products.constants - wanted).max() < 1e-4 * np.abs(wanted).max()
    step = 0.01 * np.sign(found.maps["color"])
    difference = (f.loss(x, moved(f, "color", step)) - f.loss(x, moved(f, "color", -step))) / 2
    # smape has corners, which a step crosses here and there.
    assert difference == pytest.approx(float(np.sum(step * found.maps["color"])), rel=0.05)


def test_the_same_numbers_give_the_same_bits(both: tuple[skinfit.MapObjective, skinfit.Objective]) -> None:
    f, _ = both
    (first, one), (again, other) = f.loss_and_gradient(), f.loss_and_gradient()
    assert first == again and np.array_equal(one.constants, other.constants)
    assert all(np.array_equal(one.maps[name], other.maps[name]) for name in one.maps)


def test_a_light_that_is_too_dark_is_brightened(demo_file: Path, cache: Path) -> None:
    f = of_light(demo_file, cache).map_objective("environment")
    light = 0.8 * f.maps["irradiance"]
    loss, gradients = f.loss_and_gradient(maps={"irradiance": light})
    step = 0.1 * light.max() / np.abs(gradients.maps["irradiance"]).max()
    assert f.loss(maps={"irradiance": light - step * gradients.maps["irradiance"]}) < loss


def test_what_cannot_be_is_refused(demo_file: Path, cache: Path) -> None:
    scene = skinfit.load_file(demo_file, cache=cache)
    with pytest.raises(skinfit.ParamError, match="specular_lobe cannot be fitted beside maps"):
        scene.map_objective("environment")
    with pytest.raises(skinfit.ArrayError, match="Did you mean `color`"):
        scene.map_objective("colour")
    with pytest.raises(skinfit.ArrayError, match="no maps are named"):
        scene.map_objective()
    with pytest.raises(skinfit.DeviceError, match="no such card"):
        scene.map_objective("color", adapter="no such card")
    with pytest.raises(skinfit.ViewError):
        scene.map_objective("color", hold_out=["behind"])
    with pytest.raises(skinfit.SceneError, match="no enabled effect reads specular"):
        skinfit.load_file(demo_file, effects=["diffuse"], cache=cache).map_objective("specular")
    f = scene.map_objective("color")
    color = f.maps["color"]
    with pytest.raises(skinfit.ArrayError, match="none of these maps"):
        f.loss(maps={"specular": color})
    with pytest.raises(skinfit.ArrayError, match="where the map is one of"):
        f.loss(maps={"color": color[1:]})
    with pytest.raises(skinfit.ArrayError, match="finite"):
        f.image(maps={"color": np.full_like(color, np.nan)})
    with pytest.raises(skinfit.ArrayError, match="are free"):
        f.loss(f.start[1:])
    with pytest.raises(skinfit.ArrayError):
        f.vjp(None, None, np.ones((2, 2, 3)))
    with pytest.raises(skinfit.ViewError, match="there is no view"):
        f.image(view="behind")
    outside = f.start
    outside[f.names.index("rim_exponent")] = 100.0
    with pytest.raises(skinfit.ParamError, match="out of bounds"):
        f.loss(outside)


def test_arrays_may_lie_in_memory_as_they_like(demo_file: Path, cache: Path) -> None:
    f = skinfit.load_file(demo_file, cache=cache).map_objective("color")
    color = f.maps["color"]
    color[:, :, 0] *= 0.5
    wanted = f.loss(maps={"color": color})
    assert wanted != f.loss()
    for same in [np.asfortranarray(color), color.astype(np.float64), color[::-1].copy()[::-1]]:
        assert f.loss(maps={"color": same}) == wanted
