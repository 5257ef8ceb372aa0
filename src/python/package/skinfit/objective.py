"""A scene's fit as a function of what is free, for SciPy, JAX, PyTorch or a solver of one's own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .errors import ArrayError, ParamError, ViewError
from .given import Number, name, numbers

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class NormalEquations:
    """What one pass over the samples yields, with residuals r (weighted, over pixels and channels) and their Jacobian J."""

    loss: float
    """The mean of the weighted losses."""
    residual: float
    """r'r; of a robust loss that of its reweighted quadratic."""
    weight: float
    """The sum of the weights: what the loss is a mean over."""
    count: int
    """How many residuals have a weight."""
    jtr: Vector
    """(K,): J'r."""
    jtj: Vector
    """(K, K): J'J."""


class Objective:
    """The loss of a scene over its free constants, at the values that it had when this was made.

    `x` below is an array of (K,) float64, a number for each of `names`, in the unit of its parameter (`ParamInfo.unit`;
    angles in degrees, gains without), within `bounds`: outside of them, and where it is not finite or no number,
    `ParamError` is raised; of another length, `ArrayError`.

    Loss, gradient and normal equations are those of the CPU engine, by the numbers of which `Scene.fit` goes. Images and
    products of their Jacobian are computed in float64.

    >>> import skinfit
    >>> scene = skinfit.demo()
    >>> scene.params.free_only("base_weight", "rim_exponent")
    >>> f = scene.objective()
    >>> f.names, f.start.tolist()
    (['base_weight', 'rim_exponent'], [1.0, 2.0])
    >>> loss, gradient = f.loss_and_gradient(f.start)
    >>> gradient.shape, f.normal_equations(f.start).jtj.shape, f.image(f.start, "front").shape
    ((2,), (2, 2), (320, 320, 3))
    """

    def __init__(self, native: _native.Objective) -> None:
        self._native = native

    @property
    def names(self) -> list[str]:
        """What is free: `rim_exponent`, one channel of a parameter as `hilite.r`, a view's gain as `gain.left`."""
        return self._native.names

    @property
    def views(self) -> list[str]:
        """The views that count."""
        return self._native.views

    @property
    def start(self) -> Vector:
        """(K,): the values that the scene had."""
        return self._native.start

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Least and greatest value of each, as SciPy takes them."""
        return self._native.bounds

    def loss(self, x: ArrayLike) -> float:
        """The loss that `Scene.loss` names, at `x`: the mean over weighted residuals, without priors. Of `l2` and `huber` it
        is in squared linear radiance, of `relative_l2` and `smape` dimensionless."""
        return self._native.loss(vector(x))

    def gradient(self, x: ArrayLike) -> Vector:
        """(K,): the loss' gradient, the loss per unit of each constant."""
        return self.loss_and_gradient(x)[1]

    def loss_and_gradient(self, x: ArrayLike) -> tuple[float, Vector]:
        """The loss and its gradient (K,), per unit of each constant, in one pass:
        `scipy.optimize.minimize(f.loss_and_gradient, f.start, jac=True)`."""
        return self._native.loss_and_gradient(vector(x))

    def normal_equations(self, x: ArrayLike) -> NormalEquations:
        """The loss with J'r and J'J, in one pass."""
        return NormalEquations(**self._native.normal_equations(vector(x)))

    def image(self, x: ArrayLike, view: str | None = None) -> Vector:
        """(height, width, 3): a view (the first, unless named) in linear Rec.709 radiance, premultiplied by coverage, times
        the view's gain; 0 where no skin is seen. Raises `ViewError` where there is no such view."""
        return self._native.image(vector(x), view_name(view))

    def jvp(self, x: ArrayLike, v: ArrayLike, view: str | None = None) -> Vector:
        """(height, width, 3): how `image` moves as `x` moves along `v` (K,), the Jacobian times `v`: in linear radiance, with
        `v` in the units of `x`."""
        return self._native.jvp(vector(x), vector(v), view_name(view))

    def vjp(self, x: ArrayLike, image: ArrayLike, view: str | None = None) -> Vector:
        """(K,): `image` (height, width, 3) times the Jacobian of `Objective.image`: the gradient of their inner product, a sum
        over pixels and channels, per unit of each constant."""
        return self._native.vjp(vector(x), image_array(image, np.float64), view_name(view))

    def __repr__(self) -> str:
        return f"Objective({', '.join(self.names)}; views {', '.join(self.views)})"


def view_name(view: str | None) -> str | None:
    """A view's name, as the library takes it."""
    return None if view is None else name(view, ViewError)


def vector(x: ArrayLike) -> Vector:
    """Constants, as the library takes them."""
    remedy = "Give a number for each free constant."
    # What is not finite is out of bounds, of which the library tells the constant.
    array = numbers("x", x, np.float64, remedy, kinds="fiu", finite=False, refused=ParamError)
    if array.ndim != 1:
        raise ArrayError(f"an array of shape {array.shape} is no vector. {remedy}")
    return array


def image_array(image: ArrayLike, kind: type[Number]) -> NDArray[Number]:
    """An image, as the library takes it."""
    remedy = "Give height x width x 3 numbers."
    array = numbers("image", image, kind, remedy, kinds="fiu", finite=False)
    if array.ndim != 3:
        raise ArrayError(f"an array of shape {array.shape} is no image. {remedy}")
    return array
