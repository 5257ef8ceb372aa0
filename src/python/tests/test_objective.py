"""Loss, gradient and Jacobian products, against differences and against one another."""

from typing import Any

import numpy as np
import pytest
import skinfit
from numpy.typing import NDArray
from scipy.optimize import minimize

Vector = NDArray[np.float64]


@pytest.fixture(scope="module")
def objective(demo_file, cache) -> skinfit.Objective:  # type: ignore[no-untyped-def]
    return skinfit.load_file(demo_file, cache=cache).objective()


@pytest.fixture(scope="module")
def x(objective: skinfit.Objective) -> Vector:
    """Near the start, and a way from every bound."""
    lower, upper = np.array(objective.bounds).T
    return np.clip(objective.start, lower + 0.05, upper - 0.05)


def test_the_gradient_is_that_of_the_loss(objective: skinfit.Objective, x: Vector) -> None:
    gradient = objective.gradient(x)
    # The loss rounds to some 1e-7 of itself: a step that is not too small.
    steps = 1e-3 * np.eye(len(x))
    differences = [(objective.loss(x + step) - objective.loss(x - step)) / 2e-3 for step in steps]
    assert np.abs(gradient - differences).max() < 1e-2 * np.abs(gradient).max()
    sums = objective.normal_equations(x)
    assert np.allclose(2 * sums.jtr / sums.weight, gradient, rtol=1e-5, atol=1e-12)
    assert sums.jtj.shape == (len(x), len(x)) and np.array_equal(sums.jtj, sums.jtj.T)


def test_the_loss_is_the_fits(objective: skinfit.Objective, fitted: skinfit.Fit) -> None:
    assert objective.normal_equations(objective.start).loss == fitted.report["loss"]["start"]
    assert objective.names == list(fitted.std_errors)


def differences(objective: skinfit.Objective, x: Vector, v: Vector, step: float) -> Vector:
    """How the image of the profile moves along `v`, by central differences."""
    there, back = (objective.image(x + sign * step * v, "profile") for sign in (1, -1))
    return (there - back) / (2 * step)


def test_products_of_the_jacobian_are_those_of_the_image(objective: skinfit.Objective, x: Vector) -> None:
    random = np.random.default_rng(1)
    v = random.normal(size=len(x))
    baked = np.array([name in ("normal_strength", "specular_lobe") for name in objective.names])
    assert baked.sum() == 2
    smooth = np.where(baked, 0.0, v)
    moved = objective.jvp(x, smooth, "profile")
    assert np.abs(moved).max() > 0.01
    # What float64 leaves of differences by such a step, relative to the image: some 1e-11 / 1e-5 at most.
    assert np.abs(moved - differences(objective, x, smooth, 1e-5)).max() < 1e-6 * np.abs(moved).max()
    # A bumped normal that crosses from one texel of a cube to another bends the image there: in few pixels.
    bumps = (np.array(objective.names) == "normal_strength").astype(float)
    slopes = objective.jvp(x, bumps, "profile")
    off = np.abs(slopes - differences(objective, x, bumps, 1e-5)) > 1e-5 * np.abs(slopes).max()
    assert off.mean() < 1e-3
    # Cubes hold float32, whose rounding a step has to exceed; a larger one has a curvature.
    lobe = (np.array(objective.names) == "specular_lobe").astype(float)
    slopes = objective.jvp(x, lobe, "profile")
    assert np.abs(slopes - differences(objective, x, lobe, 0.1)).max() < 1e-2 * np.abs(slopes).max()
    whole = objective.jvp(x, v, "profile")
    w = random.normal(size=whole.shape)
    # The same products, summed in another order.
    assert np.dot(objective.vjp(x, w, "profile"), v) == pytest.approx(np.sum(w * whole), rel=1e-9)


def test_the_image_is_the_drawn_one(objective: skinfit.Objective, demo_file, cache) -> None:  # type: ignore[no-untyped-def]
    drawn = skinfit.load_file(demo_file, cache=cache).render("front")
    assert np.allclose(objective.image(objective.start, "front"), drawn.image, atol=1e-5)


def test_scipy_finds_what_the_fit_finds(objective: skinfit.Objective, fitted: skinfit.Fit) -> None:
    found = minimize(
        objective.loss_and_gradient, objective.start, jac=True, bounds=objective.bounds, method="L-BFGS-B",
        options={"maxiter": 40},
    )
    assert fitted.loss <= found.fun < 0.1 * objective.loss(objective.start)


def test_what_is_no_point_is_refused(objective: skinfit.Objective, x: Vector) -> None:
    with pytest.raises(skinfit.ArrayError, match="are free"):
        objective.loss(x[:-1])
    with pytest.raises(skinfit.ArrayError):
        objective.loss(x[None])
    outside = x.copy()
    outside[objective.names.index("rim_exponent")] = 100.0
    with pytest.raises(skinfit.ParamError, match="rim_exponent = 100 is out of bounds"):
        objective.loss(outside)
    with pytest.raises(skinfit.ParamError):
        objective.loss(np.full_like(x, np.nan))
    wrongs: list[Any] = ["abc", None, x + 1j, [*x[:-1], "0.5"], np.ones(len(x), dtype=bool)]
    for wrong in wrongs:
        with pytest.raises(skinfit.ParamError, match="x: holds"):
            objective.loss(wrong)
    with pytest.raises(skinfit.ArrayError, match="complex"):
        objective.vjp(x, np.ones((2, 2, 3), dtype=complex))
    with pytest.raises(skinfit.ArrayError):
        objective.vjp(x, np.ones((2, 2, 3)))
    with pytest.raises(skinfit.ViewError, match="there is no view"):
        objective.image(x, "behind")
    with pytest.raises(skinfit.ViewError, match="no name"):
        objective.jvp(x, x, 1)  # type: ignore[arg-type]
