"""Gradients with respect to maps and light, against differences, and images and losses against the processor's."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skinfit
from numpy.typing import NDArray

Map = NDArray[np.float32]
Both = tuple[skinfit.MapObjective, skinfit.Objective]

pytestmark = pytest.mark.usefixtures("adapter")

SKIN = ("color", "specular", "attenuator", "occlusion")


def of_light(file: Path, cache: Path) -> skinfit.Scene:
    """The built-in scene, of which the environment is a map: its texels hold what the lobe does to it."""
    scene = skinfit.load_file(file, cache=cache)
    scene.params.fix("specular_lobe")
    return scene


@pytest.fixture(scope="module")
def little_file(demo_file: Path, cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built-in scene in images of a sixteenth of their pixels: where the adapter is the processor, a pass over all of them
    takes a second. Its targets are its own model's at other values."""
    folder = tmp_path_factory.mktemp("little")
    skinfit.load_file(demo_file, cache=cache).save(folder / "large.toml")
    text, sizes = re.subn("(width|height) = 320", r"\1 = 80", (folder / "large.toml").read_text(encoding="utf-8"))
    assert sizes == 6
    file = folder / "scene.toml"
    file.write_text(re.sub("(?m)^target = .*\n", "", text), encoding="utf-8")
    drawn = skinfit.load_file(file, cache=cache)
    drawn.params.set_all({"base_weight": 0.85, "rim_weight": 0.3, "rim_exponent": 2.5, "hilite": (0.6, 0.5, 0.45)})
    for view in drawn.views:
        image = drawn.render(view.name)
        skinfit._native.write_exr(folder / f"{view.name}.exr", np.dstack([image.image, image.alpha]))
    file.write_text(re.sub("(?m)^target = .*/", f'target = "{folder.as_posix()}/', text), encoding="utf-8")
    return file


@pytest.fixture(scope="module", params=["skin", "light"])
def both(request: pytest.FixtureRequest, little_file: Path, cache: Path) -> Both:
    """A function of maps, and the same of constants alone."""
    if request.param == "skin":
        scene = skinfit.load_file(little_file, cache=cache)
        return scene.map_objective(*SKIN), scene.objective()
    scene = of_light(little_file, cache)
    return scene.map_objective("environment"), scene.objective()


def across(of: Callable[[dict[str, Map]], Any], name: str, start: Map, change: NDArray[Any]) -> Any:
    """Half of how far what follows a map moves from one side of its start to the other."""
    after, before = (of({name: (start + sign * change).astype(np.float32)}) for sign in (1, -1))
    return (after - before) / 2


def test_maps_have_names_shapes_and_bounds(both: Both) -> None:
    f, constants = both
    assert f.names == constants.names and f.bounds == constants.bounds and f.views == constants.views
    assert np.array_equal(f.start, constants.start)
    maps = f.maps
    assert list(maps) in (list(SKIN), ["irradiance", "lobe", "hilite"]) and list(f.map_bounds) == list(maps)
    for name, array in maps.items():
        ends = {"color": (3,), "irradiance": (4,), "lobe": (4,), "hilite": (4,)}.get(name, ())
        assert array.dtype == np.float32, name
        assert array.shape[-1:] == ends if ends else array.ndim in (1, 2), name
    assert f.adapter in repr(f)


def test_at_the_start_images_losses_and_slopes_are_the_processors(both: Both) -> None:
    f, constants = both
    x = f.start
    for view in f.views:
        # Some ten roundings of 6e-8 of radiances of about 1.
        assert np.allclose(f.image(x, view=view), constants.image(x, view), atol=2e-6), view
    # Means over some 20,000 numbers, of which roundings leave 1e-7 at most.
    assert f.loss() == pytest.approx(constants.loss(x), rel=1e-6)
    loss, gradients = f.loss_and_gradient()
    assert loss == f.loss() == f.loss(x, f.maps)
    wanted = constants.gradient(x)
    # Sums of 32 bits in both; seen: 5e-8.
    assert np.abs(gradients.constants - wanted).max() < 1e-5 * np.abs(wanted).max()


def test_the_image_is_the_drawn_one(both: Both, little_file: Path, cache: Path) -> None:
    drawn = skinfit.load_file(little_file, cache=cache).render("profile").image
    assert np.allclose(both[0].image(view="profile"), drawn, atol=1e-5)


def test_the_gradient_is_that_of_the_loss(both: Both) -> None:
    f, _ = both

    def loss(maps: dict[str, Map]) -> float:
        return f.loss(maps=maps)

    maps, gradients = f.maps, f.loss_and_gradient()[1].maps
    assert list(gradients) == list(maps)
    for name, gradient in gradients.items():
        assert gradient.shape == maps[name].shape and np.abs(gradient).max() > 0.0, name
        # The two numbers that count most, each alone. Pixels that do not see them stay the same to the bit, so little is
        # rounded away; the loss is no square, so the difference is off by the step's square (seen: 5e-4).
        for place in np.argsort(-np.abs(gradient), axis=None)[:2]:
            change = np.zeros_like(gradient)
            change.flat[place] = 0.01
            assert across(loss, name, maps[name], change) == pytest.approx(0.01 * gradient.flat[place], rel=2e-3), name
        # All at once, along the gradient.
        along = 0.01 * gradient / np.abs(gradient).max()
        product = np.sum(along * gradient, dtype=np.float64)
        assert across(loss, name, maps[name], along) == pytest.approx(product, rel=2e-3), name


def test_products_of_the_jacobian_are_those_of_the_image(both: Both) -> None:
    f, constants = both
    random = np.random.default_rng(3)
    view = "three_quarter"

    def image(maps: dict[str, Map]) -> Any:
        return f.image(maps=maps, view=view).astype(np.float64)

    weights = random.normal(size=image({}).shape)
    found, wanted = f.vjp(None, None, weights, view), constants.vjp(f.start, weights, view)
    assert np.abs(found.constants - wanted).max() < 1e-5 * np.abs(wanted).max()
    for name, start in f.maps.items():
        # To where the product grows: nothing of it cancels. The image is linear in each map, so the step may be large; what
        # remains are its roundings, 6e-8 each and independent.
        gradient = found.maps[name].astype(np.float64)
        along = start.mean() * random.uniform(size=start.shape) * np.sign(gradient)
        moved = np.sum(weights * across(image, name, start, along))
        assert moved == pytest.approx(np.sum(gradient * along), rel=1e-5) and moved > 0.0, name


@pytest.mark.parametrize("loss", ["l2", "huber", "smape"])
def test_other_losses_and_free_gains_are_those_of_the_processor(
    loss: str, little_file: Path, cache: Path, tmp_path: Path
) -> None:
    skinfit.load_file(little_file, cache=cache).save(tmp_path / "saved.toml")
    text = (tmp_path / "saved.toml").read_text(encoding="utf-8")
    assert 'loss = "relative_l2"' in text
    file = tmp_path / "scene.toml"
    file.write_text(text.replace('loss = "relative_l2"', f'loss = "{loss}"\ngains = true'), encoding="utf-8")
    scene = skinfit.load_file(file, cache=cache)
    f, constants = scene.map_objective("color", hold_out=["profile"]), scene.objective(hold_out=["profile"])
    x = constants.start
    gain = f.names.index("gain.three_quarter")
    x[gain] = 1.1
    assert f.loss(x) == pytest.approx(constants.loss(x), rel=1e-6)
    wanted = constants.gradient(x)
    found = f.loss_and_gradient(x)[1]
    assert np.abs(found.constants - wanted).max() < 1e-5 * np.abs(wanted).max() and wanted[gain] != 0.0
    assert np.allclose(f.image(x, view="three_quarter"), constants.image(x, "three_quarter"), atol=2e-6)
    weights = np.ones_like(f.image(x))
    products, wanted = f.vjp(x, None, weights, "three_quarter"), constants.vjp(x, weights, "three_quarter")
    assert np.abs(products.constants - wanted).max() < 1e-5 * np.abs(wanted).max()
    gradient = found.maps["color"]
    along = 1e-3 * np.sign(gradient)
    moved = across(lambda maps: f.loss(x, maps), "color", f.maps["color"], along)
    # Huber's and smape have corners, which the step crosses here and there.
    assert moved == pytest.approx(np.sum(along * gradient, dtype=np.float64), rel=1e-2)


def test_the_same_numbers_give_the_same_bits(both: Both) -> None:
    f, _ = both
    (first, one), (again, other) = f.loss_and_gradient(), f.loss_and_gradient()
    assert first == again and np.array_equal(one.constants, other.constants)
    assert all(np.array_equal(one.maps[name], other.maps[name]) for name in one.maps)


def test_a_light_that_is_too_dark_is_brightened(little_file: Path, cache: Path) -> None:
    f = of_light(little_file, cache).map_objective("environment")
    light = 0.5 * f.maps["irradiance"]
    loss, gradients = f.loss_and_gradient(maps={"irradiance": light})
    step = 0.1 * light.max() / np.abs(gradients.maps["irradiance"]).max()
    assert f.loss(maps={"irradiance": light - step * gradients.maps["irradiance"]}) < loss


@pytest.mark.usefixtures("unwarned")
def test_what_cannot_be_is_refused(little_file: Path, cache: Path) -> None:
    scene = skinfit.load_file(little_file, cache=cache)
    with pytest.raises(skinfit.ParamError, match="specular_lobe cannot be fitted beside the environment"):
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
        skinfit.load_file(little_file, effects=["diffuse"], cache=cache).map_objective("specular")
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


def test_arrays_may_lie_in_memory_as_they_like(little_file: Path, cache: Path) -> None:
    f = skinfit.load_file(little_file, cache=cache).map_objective("color")
    color = f.maps["color"]
    color[:, :, 0] *= 0.5
    wanted = f.loss(maps={"color": color})
    assert wanted != f.loss()
    others: list[NDArray[Any]] = [np.asfortranarray(color), color.astype(np.float64), color[::-1].copy()[::-1]]
    for same in others:
        assert f.loss(maps={"color": same}) == wanted
