"""Losses and images as functions of PyTorch's. `src/python/test` runs them by the Python that has PyTorch."""

from pathlib import Path

import numpy as np
import pytest
import skinfit
import skinfit.torch
import torch

from test_docs import run_blocks, run_docstrings


@pytest.fixture(scope="module")
def objective(demo_file: Path, cache: Path) -> skinfit.Objective:
    return skinfit.load_file(demo_file, cache=cache).objective()


@pytest.fixture(scope="module")
def of_maps(adapter: None, demo_file: Path, cache: Path) -> skinfit.MapObjective:
    scene = skinfit.load_file(demo_file, cache=cache)
    scene.params.fix("specular_lobe")
    return scene.map_objective("color", "environment")


def inside(objective: skinfit.Objective) -> torch.Tensor:
    """Near the start, and a way from every bound."""
    lower, upper = np.array(objective.bounds).T
    return torch.tensor(np.clip(objective.start, lower + 0.05, upper - 0.05), requires_grad=True)


def test_the_loss_has_its_gradient(objective: skinfit.Objective) -> None:
    x = inside(objective)
    value = skinfit.torch.loss(objective, x)
    assert value.item() == objective.loss(x.detach().numpy())
    (3 * value).backward()
    assert np.array_equal(x.grad.numpy(), 3 * objective.gradient(x.detach().numpy()))
    assert skinfit.torch.loss(objective).item() == objective.loss(objective.start)


def test_the_image_has_its_jacobian(objective: skinfit.Objective) -> None:
    # Along a random direction; the whole Jacobian would take a product for each number of the image.
    at = inside(objective)
    assert torch.autograd.gradcheck(lambda x: skinfit.torch.image(objective, x, "front"), at, fast_mode=True)


def test_numbers_and_devices_are_the_tensors_own(objective: skinfit.Objective) -> None:
    x = inside(objective).detach().float().requires_grad_()
    picture = skinfit.torch.image(objective, x, "front")
    assert picture.dtype == torch.float32
    picture.square().sum().backward()
    assert x.grad.dtype == torch.float32 and x.grad.abs().max() > 0


def test_memory_is_shared() -> None:
    array = np.zeros(3)
    tensor = skinfit.torch._tensor(array, torch.empty(0, dtype=torch.float64))
    tensor[1] = 2.0
    assert array[1] == 2.0
    skinfit.torch._array(tensor, torch.float64)[0] = 1.0
    assert array[0] == 1.0


def test_what_is_changed_before_the_backward_pass_is_told(objective: skinfit.Objective) -> None:
    x = inside(objective)
    total = skinfit.torch.image(objective, x, "front").sum()
    with torch.no_grad():
        x[0] += 0.01
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        total.backward()


def test_there_is_one_derivative(objective: skinfit.Objective) -> None:
    x = inside(objective)
    (slope,) = torch.autograd.grad(skinfit.torch.loss(objective, x).square(), x, create_graph=True)
    with pytest.raises(RuntimeError, match="once_differentiable"):
        slope.sum().backward()


def test_maps_have_their_gradients(of_maps: skinfit.MapObjective) -> None:
    x = torch.tensor(of_maps.start, requires_grad=True)
    maps = {name: torch.from_dlpack(array).requires_grad_() for name, array in of_maps.maps.items()}
    value = skinfit.torch.loss(of_maps, x, maps)
    wanted, gradients = of_maps.loss_and_gradient()
    assert value.item() == wanted and value.dtype == torch.float64
    value.backward()
    assert np.array_equal(x.grad.numpy(), gradients.constants)
    for name, tensor in maps.items():
        assert np.array_equal(tensor.grad.numpy(), gradients.maps[name]), name


def test_images_have_their_slopes_along_maps(of_maps: skinfit.MapObjective) -> None:
    generator = torch.Generator().manual_seed(1)
    start = {name: torch.from_dlpack(array) for name, array in of_maps.maps.items()}
    picture = skinfit.torch.image(of_maps, view="front", maps=start)
    weights = torch.randn(picture.shape, generator=generator)

    def weighed(maps: dict[str, torch.Tensor]) -> torch.Tensor:
        return (weights * skinfit.torch.image(of_maps, view="front", maps=maps)).sum(dtype=torch.float64)

    for name in start:
        tensor = start[name].clone().requires_grad_()
        weighed({**start, name: tensor}).backward()
        # To where it grows: nothing cancels. The image is linear in each map.
        along = start[name].mean() * torch.rand(tensor.shape, generator=generator) * tensor.grad.sign()
        after, before = (weighed({**start, name: start[name] + sign * along}) for sign in (1, -1))
        product = (tensor.grad * along).sum(dtype=torch.float64)
        assert ((after - before) / 2).item() == pytest.approx(product.item(), rel=1e-5), name


def test_maps_that_a_network_makes_are_fitted(of_maps: skinfit.MapObjective) -> None:
    # One factor on the colour map, which is too bright for the constants of the start.
    color = torch.from_dlpack(of_maps.maps["color"])
    factor = torch.tensor(1.0, requires_grad=True)
    optimiser = torch.optim.Adam([factor], lr=0.05)
    losses = []
    for _ in range(3):
        optimiser.zero_grad()
        value = skinfit.torch.loss(of_maps, maps={"color": factor * color})
        value.backward()
        optimiser.step()
        losses.append(value.item())
    assert losses[0] > losses[1] > losses[2] and factor.item() < 0.9


def test_maps_are_of_functions_of_maps(objective: skinfit.Objective) -> None:
    with pytest.raises(skinfit.ArrayError, match="map_objective"):
        skinfit.torch.loss(objective, maps={"color": torch.ones(2, 2, 3)})


def test_the_examples_run(adapter: None, unwarned: None) -> None:
    run_docstrings("skinfit.torch")
    assert run_blocks(torch=True) >= 1
