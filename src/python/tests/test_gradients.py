"""Gradients by the checks of others: SciPy's against its own differences. Those of PyTorch and JAX stand in their tests."""

from pathlib import Path

import numpy as np
import pytest
import skinfit
from numpy.typing import NDArray
from scipy.optimize import approx_fprime, check_grad

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
    # Gauss and Newton's curvature lacks what bends the residuals themselves: the exponent's is some four times as large.
    bent = 2.0 * STEP / 2.0 * np.linalg.norm(curvature)
    rounded = np.sqrt(x.size) * 2.0 * ROUNDING * sums.loss / STEP
    return float(bent + rounded)


def test_scipy_checks_the_gradient(objective: skinfit.Objective, x: Vector) -> None:
    off = check_grad(objective.loss, objective.gradient, x, epsilon=STEP)
    assert off < allowed(objective, x) < 0.02 * np.linalg.norm(objective.gradient(x))


def test_a_wrong_gradient_would_be_seen(objective: skinfit.Objective, x: Vector) -> None:
    differences = approx_fprime(x, objective.loss, STEP)
    gradient = objective.gradient(x)
    for place in np.argsort(-np.abs(gradient))[:3]:
        wrong = gradient.copy()
        wrong[place] *= -1.0
        assert np.linalg.norm(differences - wrong) > allowed(objective, x), objective.names[place]
