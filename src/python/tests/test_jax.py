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
    check_grads(jax.jit(image), (jnp.array(x),), order=1, modes=["rev"])


def test_it_answers_in_the_kind_that_it_is_asked_in(objective: skinfit.Objective, x: Vector) -> None:
    with jax.enable_x64(False):
        narrow = jnp.array(x)
        assert narrow.dtype == jnp.float32
        gradient = jax.grad(skinfit.jax.loss(objective))(narrow)
        assert gradient.dtype == jnp.float32
        exact = objective.gradient(np.asarray(narrow, np.float64))
        assert np.array_equal(gradient, exact.astype(np.float32))


def test_what_is_no_point_is_told(objective: skinfit.Objective, x: Vector) -> None:
    outside = jnp.array(x).at[objective.names.index("rim_exponent")].set(100.0)
    with pytest.raises(Exception, match="rim_exponent = 100 is out of bounds"):
        skinfit.jax.loss(objective)(outside).block_until_ready()
