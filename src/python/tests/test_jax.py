"""The loss and images as functions of JAX's: the same numbers, and the same derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import skinfit
import skinfit.jax
from jax.test_util import check_grads
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@pytest.fixture(autouse=True)
def in_64_bits():  # type: ignore[no-untyped-def]
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="module")
def objective(small_file, cache) -> skinfit.Objective:  # type: ignore[no-untyped-def]
    return skinfit.load_file(small_file, cache=cache).objective()


@pytest.fixture
def x(objective: skinfit.Objective) -> Vector:
    lower, upper = np.array(objective.bounds).T
    return np.clip(objective.start, lower + 0.05, upper - 0.05)


def test_the_loss_has_its_gradient(objective: skinfit.Objective, x: Vector) -> None:
    loss = skinfit.jax.loss(objective)
    for function in (jax.value_and_grad(loss), jax.jit(jax.value_and_grad(loss))):
        value, gradient = function(jnp.array(x))
        assert value == objective.loss(x) and np.array_equal(gradient, objective.gradient(x))
    twice = jax.grad(lambda y: 2.0 * loss(y) + y.sum())(jnp.array(x))
    # Sums of one or two products in float64.
    assert np.allclose(twice, 2.0 * objective.gradient(x) + 1.0, rtol=1e-14)
    many = jax.vmap(loss)(jnp.stack([jnp.array(x), jnp.array(objective.start)]))
    assert np.array_equal(many, [objective.loss(x), objective.loss(objective.start)])


def test_the_image_has_its_gradient(objective: skinfit.Objective, x: Vector) -> None:
    image = skinfit.jax.image(objective, "side")
    drawn, backward = jax.vjp(image, jnp.array(x))
    assert np.array_equal(drawn, objective.image(x, "side"))
    weights = np.random.default_rng(2).normal(size=drawn.shape)
    assert np.array_equal(backward(jnp.array(weights))[0], objective.vjp(x, weights, "side"))
    # Differences of float64 by JAX's step for it; the image is smooth in what is free here.
    check_grads(jax.jit(image), (jnp.array(x),), order=1, modes=["fwd", "rev"])
    along = np.random.default_rng(3).normal(size=x.shape)
    _, moved = jax.jit(lambda y, dy: jax.jvp(image, (y,), (dy,)))(jnp.array(x), jnp.array(along))
    assert np.array_equal(moved, objective.jvp(x, along, "side"))


def test_a_jacobian_is_the_same_by_either_mode(objective: skinfit.Objective, x: Vector) -> None:
    image = skinfit.jax.image(objective, "side")

    def patch(y: jax.Array) -> jax.Array:
        return image(y)[20:22, 24:26]

    forward, reverse = jax.jacfwd(patch)(jnp.array(x)), jax.jit(jax.jacrev(patch))(jnp.array(x))
    assert forward.shape == (2, 2, 3, x.size) and np.abs(forward).max() > 1e-3
    # Sums over few samples in another order.
    assert np.allclose(forward, reverse, rtol=1e-12, atol=1e-15)
    slope = jax.jvp(skinfit.jax.loss(objective), (jnp.array(x),), (jnp.ones(x.size),))[1]
    assert np.isclose(slope, objective.gradient(x).sum(), rtol=1e-13)


def test_a_second_derivative_is_refused(objective: skinfit.Objective, x: Vector) -> None:
    image = skinfit.jax.image(objective, "side")
    for function in (lambda y: image(y).sum(), skinfit.jax.loss(objective)):
        for hessian in (jax.hessian(function), jax.jit(jax.jacrev(jax.grad(function)))):
            with pytest.raises(TypeError, match="first derivatives alone"):
                hessian(jnp.array(x))
    with jax.enable_x64(False), pytest.raises(TypeError, match="first derivatives alone"):
        jax.hessian(skinfit.jax.loss(objective))(jnp.array(x))


def test_it_answers_in_the_kind_that_it_is_asked_in(objective: skinfit.Objective, x: Vector) -> None:
    with jax.enable_x64(False):
        narrow = jnp.array(x)
        assert narrow.dtype == jnp.float32
        gradient = jax.grad(skinfit.jax.loss(objective))(narrow)
        assert gradient.dtype == jnp.float32
        exact = objective.gradient(np.asarray(narrow, np.float64))
        assert np.array_equal(gradient, exact.astype(np.float32))


def test_64_bits_stay_64_bits_on_a_thread_that_is_told_nothing_of_them(objective: skinfit.Objective, x: Vector) -> None:
    # JAX calls back on any thread; here it is one without the caller's `jax.enable_x64`.
    loss = skinfit.jax.loss(objective)
    both = jax.jit(jax.value_and_grad(loss)).lower(jnp.array(x)).compile()
    pull = jax.jit(lambda y, weights: jax.vjp(skinfit.jax.image(objective, "side"), y)[1](weights))
    weights = np.random.default_rng(4).normal(size=objective.image(x, "side").shape)
    given = jnp.array(x), jnp.array(weights)
    product = pull.lower(*given).compile()
    with jax.enable_x64(False):
        value, gradient = both(given[0])
        assert np.asarray(value) == objective.loss(x) and np.array_equal(gradient, objective.gradient(x))
        assert np.array_equal(product(*given)[0], objective.vjp(x, weights, "side"))


def test_what_is_no_point_is_told(objective: skinfit.Objective, x: Vector) -> None:
    outside = jnp.array(x).at[objective.names.index("rim_exponent")].set(100.0)
    with pytest.raises(Exception, match="rim_exponent = 100 is out of bounds"):
        skinfit.jax.loss(objective)(outside).block_until_ready()
