"""Losses and images as functions of PyTorch's. `src/python/test` runs them by the Python that has PyTorch."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skinfit
import skinfit.torch
import torch

from test_docs import run_blocks, run_docstrings


@pytest.fixture(scope="module")
def objective(small_file: Path, cache: Path) -> skinfit.Objective:
    return skinfit.load_file(small_file, cache=cache).objective()


@pytest.fixture(scope="module")
def of_maps(adapter: None, small_file: Path, cache: Path) -> skinfit.MapObjective:
    return skinfit.load_file(small_file, cache=cache).map_objective("color", "environment")


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


def test_torch_checks_the_gradient_of_the_loss(objective: skinfit.Objective) -> None:
    at = inside(objective)
    most = np.abs(objective.gradient(at.detach().numpy())).max()
    # Sums of 32 bits leave some 1e-7 of the loss: a step that is not too small. What it bends goes by the step's square.
    assert torch.autograd.gradcheck(lambda x: skinfit.torch.loss(objective, x), at, eps=1e-3, atol=1e-3 * most, rtol=0.0)


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


class Watched:
    """An objective that keeps the last image that it has drawn."""

    def __init__(self, objective: skinfit.Objective) -> None:
        self.objective = objective
        self.start = objective.start

    def image(self, x: Any, view: str | None = None) -> Any:
        self.drawn = self.objective.image(x, view)
        return self.drawn


def test_what_is_computed_becomes_a_tensor_without_a_copy(objective: skinfit.Objective) -> None:
    watched: Any = Watched(objective)
    x = inside(objective).detach()
    picture = skinfit.torch.image(watched, x, "front")
    address, _ = watched.drawn.__array_interface__["data"]
    assert picture.data_ptr() == address and picture.dtype == torch.float64
    # Of another kind of number it is one.
    assert skinfit.torch.image(watched, x.float(), "front").data_ptr() != watched.drawn.__array_interface__["data"][0]


def test_tensors_that_are_given_are_copied(objective: skinfit.Objective) -> None:
    x = inside(objective).detach()
    before = skinfit.torch.image(objective, x, "front")
    kept = before.clone()
    before.zero_()
    again = skinfit.torch.image(objective, x, "front")
    # Neither does what is made of the tensor follow it, nor what is computed next the last image.
    x += 1.0
    assert torch.equal(again, kept)


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


def with_number(map_: torch.Tensor, place: int, number: torch.Tensor) -> torch.Tensor:
    """The map with another number in one place."""
    return map_.flatten().index_put((torch.tensor([place]),), number.float().reshape(1)).reshape(map_.shape)


def test_torch_checks_the_gradient_of_a_loss_of_maps(of_maps: skinfit.MapObjective) -> None:
    x = torch.tensor(of_maps.start)
    start = {name: torch.from_dlpack(array) for name, array in of_maps.maps.items()}
    gradients = of_maps.loss_and_gradient()[1].maps
    # Of each map the number that counts most.
    places = {name: int(np.abs(gradients[name]).argmax()) for name in start}

    def loss(few: torch.Tensor) -> torch.Tensor:
        maps = {name: with_number(start[name], place, number) for (name, place), number in zip(places.items(), few)}
        return skinfit.torch.loss(of_maps, x, maps)

    few = torch.stack([start[name].flatten()[place] for name, place in places.items()]).double().requires_grad_()
    # The adapter has numbers in 32 bits, of which a step of 1/128 keeps enough. The loss is no square: the difference is off by
    # the step's square.
    assert torch.autograd.gradcheck(loss, few, eps=2.0**-7, atol=0.0, rtol=2e-3)


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
    assert run_docstrings("skinfit.torch") > 0
    assert run_blocks(torch=True) >= 1
