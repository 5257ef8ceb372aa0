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
    >>> drawn, moved = jax.jvp(skinfit.jax.image(f, "front"), (x,), (jnp.array([1.0, 0.0]),))
    >>> moved.shape
    (320, 320, 3)

Everything is computed by skinfit on the processor, in float64, and handed over in the kind of `x`: float32, unless JAX
was told `jax_enable_x64`. Derivatives are of both modes, and first ones alone: a second one is refused. `jax.jit` calls
back, and `jax.vmap` calls once for each. What is no point of the objective raises `ParamError` where JAX does not wrap it: within `jax.jit` it
is an error of JAX's that quotes it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from .objective import Objective

__all__ = ["image", "loss"]


def loss(objective: Objective) -> Callable[[jax.Array], jax.Array]:
    """The loss as a function of the constants (K,), in the order of `objective.names`."""

    @jax.custom_jvp
    def value(x: jax.Array) -> jax.Array:
        return _called(objective.loss, (), x)

    def slope(points: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        # One pass for both.
        (x,), (dx,) = points, tangents
        both = _called(lambda at: np.append(*objective.loss_and_gradient(at)), (len(objective.names) + 1,), x)
        return both[0], both[1:] @ dx

    value.defjvp(slope)
    function: Callable[[jax.Array], jax.Array] = value
    return function


def image(objective: Objective, view: str | None = None) -> Callable[[jax.Array], jax.Array]:
    """A view's image (height, width, 3), as of `Objective.image`, as a function of the constants (K,)."""
    shape = objective.image(objective.start, view).shape

    @jax.custom_jvp
    def value(x: jax.Array) -> jax.Array:
        return _called(lambda at: objective.image(at, view), shape, x)

    def slope(points: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        (x,), (dx,) = points, tangents
        return value(x), _JVP.bind(x, dx, objective=objective, view=view, shape=shape)

    value.defjvp(slope)
    function: Callable[[jax.Array], jax.Array] = value
    return function


def _no_second(*_: Any, **__: Any) -> Any:
    """Refuses to differentiate what is a derivative already, or is computed by one pass with it."""
    raise TypeError("skinfit has first derivatives alone. For a Hessian take Objective.normal_equations.")


def _called(function: Callable[..., Any], shape: tuple[int, ...], *arrays: jax.Array) -> jax.Array:
    """What skinfit makes of these arrays, in the kind of the first."""
    kind = jnp.result_type(arrays[0], float)
    # JAX calls back on a thread of its own, which need not know of a `jax.enable_x64` of the caller's and would round
    # float64 to float32 there. So float64 goes both ways as its bits.
    wide = kind == jnp.float64

    def call(*given: Any) -> Any:
        read = (np.asarray(array).view(np.float64)[..., 0] if wide else np.asarray(array, np.float64) for array in given)
        answer = np.asarray(function(*read), kind, order="C")
        return answer[..., np.newaxis].view(np.uint32) if wide else answer

    # Bits have no tangents: without a rule of its own this would be a constant.
    @jax.custom_jvp
    def result(*arrays: jax.Array) -> jax.Array:
        if not wide:
            narrow: jax.Array = jax.pure_callback(
                call, jax.ShapeDtypeStruct(shape, kind), *arrays, vmap_method="sequential"
            )
            return narrow
        bits = (jax.lax.bitcast_convert_type(array.astype(kind), jnp.uint32) for array in arrays)
        answer = jax.pure_callback(call, jax.ShapeDtypeStruct((*shape, 2), jnp.uint32), *bits, vmap_method="sequential")
        exact: jax.Array = jax.lax.bitcast_convert_type(answer, kind)
        return exact

    result.defjvp(_no_second)
    found: jax.Array = result(*arrays)
    return found


def _linear(name: str, product: Callable[..., Any], made: Callable[..., tuple[int, ...]]) -> Primitive:
    """A product of an image's Jacobian at `x` with something that it is linear in: JAX has no other door to tell it so
    than a primitive."""
    primitive = Primitive(name)

    def called(x: jax.Array, along: jax.Array, **of: Any) -> jax.Array:
        return _called(lambda *at: product(of["objective"], *at, of["view"]), made(**of), x, along)

    def each(arrays: tuple[jax.Array, ...], axes: tuple[int | None, ...], **of: Any) -> tuple[jax.Array, int]:
        count = next(array.shape[axis] for array, axis in zip(arrays, axes) if axis is not None)
        stacks = [
            jnp.broadcast_to(array, (count, *array.shape)) if axis is None else jnp.moveaxis(array, axis, 0)
            for array, axis in zip(arrays, axes)
        ]
        return jax.lax.map(lambda pair: primitive.bind(*pair, **of), tuple(stacks)), 0

    primitive.def_impl(called)
    primitive.def_abstract_eval(lambda _, along, **of: jax.core.ShapedArray(made(**of), along.dtype))
    mlir.register_lowering(primitive, mlir.lower_fun(called, multiple_results=False))
    ad.defjvp(primitive, _no_second, lambda tangent, x, _, **of: primitive.bind(x, tangent, **of))
    batching.primitive_batchers[primitive] = each
    return primitive


_JVP = _linear("skinfit_jvp", Objective.jvp, lambda shape, **_: shape)
_VJP = _linear("skinfit_vjp", Objective.vjp, lambda objective, **_: (len(objective.names),))
# Each is the other's transpose.
ad.primitive_transposes[_JVP] = lambda weights, x, _, **of: (None, _VJP.bind(x, weights, **of))
ad.primitive_transposes[_VJP] = lambda tangent, x, _, **of: (None, _JVP.bind(x, tangent, **of))
