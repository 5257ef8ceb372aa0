"""Gradients by the checks of others: SciPy's against its own differences. Those of PyTorch and JAX stand in their tests."""

from pathlib import Path

import numpy as np
import pytest
import skinfit
from numpy.typing import NDArray
from scipy.optimize import check_grad

Vector = NDArray[np.float64]

# Sums of 32 bits leave some 1e-7 of the loss; a step of 1e-3 has them at 1e-4 of it, while its curvature stays small.
STEP = 1e-3
ROUNDING = 1e-7


@pytest.fixture(scope="module", params=["demo_file", "small_file"])
def objective(request: pytest.FixtureRequest, cache: Path) -> skinfit.Objective:
    return skinfit.load_file(request.getfixturevalue(request.param), cache=cache).objective()


@pytest.fixture
def x(objective: skinfit.Objective) -> Vector:
    """Near the start, and a way from every bound."""
    lower, upper = np.array(objective.bounds).T
    x: Vector = np.clip(objective.start, lower + 0.05, upper - 0.05)
    return x


def allowed(objective: skinfit.Objective, x: Vector) -> float:
    """How far forward differences may be off: by half a step times the curvature, and by what is rounded."""
    sums = objective.normal_equations(x)
    curvature = 2.0 * np.diag(sums.jtj) / sums.weight
    # Gauss and Newton's curvature lacks what bends the residuals themselves: with it the exponent's is up to twice as large.
    bent = 2.0 * (0.5 * STEP * np.linalg.norm(curvature))
    rounded = np.sqrt(x.size) * 2.0 * ROUNDING * sums.loss / STEP
    return float(bent + rounded)


def test_scipy_checks_the_gradient(objective: skinfit.Objective, x: Vector) -> None:
    off = check_grad(objective.loss, objective.gradient, x, epsilon=STEP)
    assert off < allowed(objective, x) < 0.02 * np.linalg.norm(objective.gradient(x))


def test_central_differences_tell_a_gradient_that_is_off_by_a_hundredth(objective: skinfit.Objective, x: Vector) -> None:
    steps = STEP * np.eye(x.size)
    differences = np.array([(objective.loss(x + step) - objective.loss(x - step)) / (2.0 * STEP) for step in steps])
    gradient = objective.gradient(x)
    # What a step's third derivatives leave is a thousandth of the greatest slope, and rounding less.
    within = 2e-3 * np.abs(gradient).max()
    assert np.abs(differences - gradient).max() < within
    place = int(np.argmax(np.abs(gradient)))
    assert abs(differences[place] - 1.01 * gradient[place]) > within, objective.names[place]
