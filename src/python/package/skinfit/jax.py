"""A scene's loss and images as functions of JAX's, differentiable with respect to the free constants.

    >>> import jax, jax.numpy as jnp
    >>> import skinfit, skinfit.jax
    >>> scene = skinfit.demo()
    >>> scene.params.free_only("base_weight", "rim_exponent")
    >>> f = scene.objective()
    >>> x = jnp.array(f.start)
    >>> value, gradient = jax.jit(jax.value_and_grad(skinfit.jax.loss(f)))(x)
    >>> value.shape, gradient.shape
    ((), (2,))
    >>> drawn, backward = jax.vjp(skinfit.jax.image(f, "front"), x)
    >>> drawn.shape, backward(drawn)[0].shape
    ((320, 320, 3), (2,))

Everything is computed by skinfit on the processor, in float64, and handed over in the kind of `x`: float32, unless JAX
was told `jax_enable_x64`. Gradients are of reverse mode, first derivatives alone; `jax.jit` calls back, and `jax.vmap`
calls once for each. What is no point of the objective raises `ParamError` where JAX does not wrap it: within `jax.jit` it
is an error of JAX's that quotes it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .objective import Objective

__all__ = ["image", "loss"]


def loss(objective: Objective) -> Callable[[jax.Array], jax.Array]:
    """The loss as a function of the constants (K,), in the order of `objective.names`."""

    @jax.custom_vjp
    def value(x: jax.Array) -> jax.Array:
        return _called(lambda at: objective.loss(at), (), x)

    def forward(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        # One pass for both.
        both = _called(lambda at: np.append(*objective.loss_and_gradient(at)), (len(objective.names) + 1,), x)
        return both[0], both[1:]

    def backward(gradient: jax.Array, slope: jax.Array) -> tuple[jax.Array]:
        return (slope * gradient,)

    value.defvjp(forward, backward)
    function: Callable[[jax.Array], jax.Array] = value
    return function


def image(objective: Objective, view: str | None = None) -> Callable[[jax.Array], jax.Array]:
    """A view's image (height, width, 3), as of `Objective.image`, as a function of the constants (K,)."""
    shape = objective.image(objective.start, view).shape

    @jax.custom_vjp
    def value(x: jax.Array) -> jax.Array:
        return _called(lambda at: objective.image(at, view), shape, x)

    def forward(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        return value(x), x

    def backward(x: jax.Array, slope: jax.Array) -> tuple[jax.Array]:
        return (_called(lambda at, weights: objective.vjp(at, weights, view), x.shape, x, slope),)

    value.defvjp(forward, backward)
    function: Callable[[jax.Array], jax.Array] = value
    return function


def _called(function: Callable[..., Any], shape: tuple[int, ...], *arrays: jax.Array) -> jax.Array:
    """What skinfit makes of these arrays, in the kind of the first."""
    kind = jnp.result_type(arrays[0], float)

    def call(*given: Any) -> Any:
        return np.asarray(function(*(np.asarray(array, np.float64) for array in given)), kind)

    result: jax.Array = jax.pure_callback(call, jax.ShapeDtypeStruct(shape, kind), *arrays, vmap_method="sequential")
    return result
