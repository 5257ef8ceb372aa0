"""A scene's loss and images as functions of PyTorch's, differentiable with respect to the free constants and to maps.

    >>> import torch, skinfit, skinfit.torch
    >>> f = skinfit.demo().objective()
    >>> x = torch.tensor(f.start, requires_grad=True)
    >>> skinfit.torch.loss(f, x).backward()
    >>> x.grad.shape == x.shape
    True
    >>> skinfit.torch.image(f, x, "front").shape
    torch.Size([320, 320, 3])

Of `Scene.map_objective` they take maps as well, by name:

    >>> f = skinfit.demo().map_objective("color")
    >>> color = torch.from_dlpack(f.maps["color"]).requires_grad_()
    >>> skinfit.torch.loss(f, maps={"color": color}).backward()
    >>> color.grad.shape == color.shape
    True

Constants alone are computed on the processor, in float64; maps on a graphics adapter, in float32. What is computed becomes a
tensor in the memory that it was computed into (DLPack), unless that is to be on another device or of another kind of number.
Tensors that are given are copied at each call. First derivatives alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union

import torch

from .errors import ArrayError
from .maps import MapGradients, MapObjective
from .objective import Objective

__all__ = ["image", "loss"]

AnyObjective = Union[Objective, MapObjective]

Maps = Optional[Mapping[str, torch.Tensor]]
"""Maps by name; those that are not given stand as they were at the start."""

Point = Sequence[Optional[torch.Tensor]]
"""Constants, or `None` for those of the start; then maps."""


def loss(objective: AnyObjective, x: torch.Tensor | None = None, maps: Maps = None) -> torch.Tensor:
    """The loss, a tensor of one number, at the constants `x` (K,), in the order of `objective.names`; without `x` at those
    of the start. It is of the kind and on the device of `x`, or else of the first map."""
    names, point = _given(objective, x, maps)
    result: torch.Tensor = _Loss.apply(objective, names, *point)
    return result


def image(
    objective: AnyObjective, x: torch.Tensor | None = None, view: str | None = None, maps: Maps = None
) -> torch.Tensor:
    """A view's image (height, width, 3), as of `Objective.image`, at the constants `x` (K,); all else as of `loss`."""
    names, point = _given(objective, x, maps)
    result: torch.Tensor = _Image.apply(objective, view, names, *point)
    return result


class _Loss(torch.autograd.Function):
    @staticmethod
    def forward(context: Any, objective: AnyObjective, names: list[str], *point: torch.Tensor | None) -> torch.Tensor:
        arguments = _arguments(objective, names, point)
        if not any(context.needs_input_grad):
            return _like(point).new_tensor(objective.loss(*arguments))
        value, gradients = objective.loss_and_gradient(*arguments)
        context.save_for_backward(*_tensors(gradients, names, point))
        return _like(point).new_tensor(value)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(context: Any, slope: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        gradients = context.saved_tensors
        return (None, None, *(None if gradient is None else slope.to(gradient) * gradient for gradient in gradients))


class _Image(torch.autograd.Function):
    @staticmethod
    def forward(
        context: Any, objective: AnyObjective, view: str | None, names: list[str], *point: torch.Tensor | None
    ) -> torch.Tensor:
        context.objective, context.view, context.names = objective, view, names
        # PyTorch tells where they are changed before the backward pass.
        context.save_for_backward(*point)
        arguments = [*_arguments(objective, names, point), view]
        return _tensor(objective.image(*arguments), _like(point))

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(context: Any, slope: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        objective, names, point = context.objective, context.names, context.saved_tensors
        kind = torch.float32 if isinstance(objective, MapObjective) else torch.float64
        gradients = objective.vjp(*_arguments(objective, names, point), _array(slope, kind), context.view)
        return (None, None, None, *_tensors(gradients, names, point))


def _given(objective: AnyObjective, x: torch.Tensor | None, maps: Maps) -> tuple[list[str], Point]:
    """The names of the maps, and the point."""
    maps = maps or {}
    if maps and not isinstance(objective, MapObjective):
        raise ArrayError("this is a function of constants alone: Scene.map_objective makes one of maps.")
    return list(maps), [x, *maps.values()]


def _arguments(objective: AnyObjective, names: list[str], point: Point) -> Any:
    """What the methods of the objective take first."""
    x, *maps = point
    constants = objective.start if x is None else _array(x, torch.float64)
    if isinstance(objective, MapObjective):
        return constants, {name: _array(map_, torch.float32) for name, map_ in zip(names, maps) if map_ is not None}
    return (constants,)


def _tensors(gradients: Any, names: list[str], point: Point) -> list[torch.Tensor | None]:
    """A gradient as tensors, each like the one that it is with respect to."""
    if isinstance(gradients, MapGradients):
        arrays = [gradients.constants, *(gradients.maps[name] for name in names)]
    else:
        arrays = [gradients]
    return [None if of is None else _tensor(array, of) for array, of in zip(arrays, point)]


def _like(point: Point) -> torch.Tensor:
    """The first tensor of a point, after which results are made."""
    return next((of for of in point if of is not None), torch.empty(0, dtype=torch.float64))


def _array(tensor: torch.Tensor, kind: torch.dtype) -> Any:
    return tensor.detach().to(device="cpu", dtype=kind).numpy()


def _tensor(array: Any, like: torch.Tensor) -> torch.Tensor:
    return torch.from_dlpack(array).to(device=like.device, dtype=like.dtype)
