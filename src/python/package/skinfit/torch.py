"""A scene's loss and images as functions of PyTorch's, differentiable with respect to the free constants.

    import torch, skinfit, skinfit.torch

    f = skinfit.demo().objective()
    x = torch.tensor(f.start, requires_grad=True)
    skinfit.torch.loss(f, x).backward()        # x.grad is the loss' gradient
    image = skinfit.torch.image(f, x, "front") # (height, width, 3), differentiable

Everything is computed by skinfit on the processor, in float64; a tensor elsewhere, or of another kind, is taken there and
its gradient back. First derivatives alone.
"""

from __future__ import annotations

from typing import Any

import torch

from .objective import Objective

__all__ = ["image", "loss"]


def loss(objective: Objective, x: torch.Tensor) -> torch.Tensor:
    """The loss, a tensor of one number, at the constants `x` (K,), in the order of `objective.names`."""
    result: torch.Tensor = _Loss.apply(x, objective)
    return result


def image(objective: Objective, x: torch.Tensor, view: str | None = None) -> torch.Tensor:
    """A view's image (height, width, 3), as of `Objective.image`, at the constants `x` (K,)."""
    result: torch.Tensor = _Image.apply(x, objective, view)
    return result


class _Loss(torch.autograd.Function):
    @staticmethod
    def forward(context: Any, x: torch.Tensor, objective: Objective) -> torch.Tensor:
        value, gradient = objective.loss_and_gradient(_numbers(x))
        context.save_for_backward(x.new_tensor(gradient))
        return x.new_tensor(value)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(context: Any, slope: torch.Tensor) -> tuple[torch.Tensor, None]:
        (gradient,) = context.saved_tensors
        return slope * gradient, None


class _Image(torch.autograd.Function):
    @staticmethod
    def forward(context: Any, x: torch.Tensor, objective: Objective, view: str | None) -> torch.Tensor:
        context.numbers, context.objective, context.view = _numbers(x), objective, view
        return x.new_tensor(objective.image(context.numbers, view))

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(context: Any, slope: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        product = context.objective.vjp(context.numbers, _numbers(slope), context.view)
        return slope.new_tensor(product), None, None


def _numbers(tensor: torch.Tensor) -> Any:
    return tensor.detach().to(device="cpu", dtype=torch.float64).numpy()
