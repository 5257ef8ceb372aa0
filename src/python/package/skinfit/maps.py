"""A scene's fit as a function of what is free and of whole maps, on a graphics adapter.

    >>> import skinfit
    >>> f = skinfit.demo().map_objective("color")
    >>> loss, gradients = f.loss_and_gradient(maps={"color": 0.9 * f.maps["color"]})
    >>> gradients.maps["color"].shape == f.maps["color"].shape, gradients.constants.shape == f.start.shape
    (True, True)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .objective import Vector, image_array, vector

Map = NDArray[np.float32]

Maps = Mapping[str, ArrayLike]
"""Maps by their names; those that are not given stand as they were at the start."""


@dataclass(frozen=True)
class MapGradients:
    """A gradient with respect to constants and maps."""

    constants: Vector
    """(K,)."""
    maps: dict[str, Map]
    """By name, each of the shape of the map."""


class MapObjective:
    """The loss of a scene over its free constants and over maps, at the values that it had when this was made.

    `x` below is an array of (K,) float64, as of `Objective`, and `None` stands for `start`. `maps` are arrays of float32, by
    the names and of the shapes of those in `MapObjective.maps`; what they hold there:

    - `color` (height, width, 3), `specular` and `attenuator` (height, width): textures, linear, row by row from the top;
    - `occlusion` (vertices,): the open share of the hemisphere of every vertex;
    - `irradiance`, `lobe` and `hilite` (6, size, size, 4): the cubes that light is looked up in, faces in the order +X, -X,
      +Y, -Y, +Z, -Z; red, green, blue, and the luminance that haze reads.

    Arrays of other shapes, and numbers that are not finite, raise `ArrayError`. Everything is computed in float32 on the
    adapter, the loss' sum in float64. Made by `Scene.map_objective`.
    """

    def __init__(self, native: _native.MapObjective) -> None:
        self._native = native

    @property
    def names(self) -> list[str]:
        """What is free, as of `Objective`."""
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
        """Least and greatest value of each."""
        return self._native.bounds

    @property
    def adapter(self) -> str:
        """The adapter's name."""
        return self._native.adapter

    @property
    def maps(self) -> dict[str, Map]:
        """The maps as they were at the start, by name: new arrays each time."""
        return self._native.maps

    @property
    def map_bounds(self) -> dict[str, tuple[float, float]]:
        """Least and greatest value that a fit allows each map, by name; they are not asked of arrays here."""
        return self._native.map_bounds

    def loss(self, x: ArrayLike | None = None, maps: Maps | None = None) -> float:
        """The loss, without the priors of a fit of maps."""
        return self._native.loss(self._point(x), _arrays(maps))

    def loss_and_gradient(self, x: ArrayLike | None = None, maps: Maps | None = None) -> tuple[float, MapGradients]:
        """The loss and its gradient with respect to all constants and all maps, in one pass forwards and one backwards."""
        loss, constants, found = self._native.loss_and_gradient(self._point(x), _arrays(maps))
        return loss, MapGradients(constants, found)

    def image(self, x: ArrayLike | None = None, maps: Maps | None = None, view: str | None = None) -> Map:
        """(height, width, 3): a view (the first, unless named), as of `Objective.image`, in float32."""
        return self._native.image(self._point(x), _arrays(maps), view)

    def vjp(
        self, x: ArrayLike | None, maps: Maps | None, image: ArrayLike, view: str | None = None
    ) -> MapGradients:
        """`image` (height, width, 3) times the Jacobian of `MapObjective.image`: the gradient of their inner product."""
        found = self._native.vjp(self._point(x), _arrays(maps), image_array(image, np.float32), view)
        return MapGradients(*found)

    def _point(self, x: ArrayLike | None) -> Vector:
        return self.start if x is None else vector(x)

    def __repr__(self) -> str:
        maps = ", ".join(self.map_bounds)
        return f"MapObjective({', '.join(self.names)}; maps {maps}; views {', '.join(self.views)}; on {self.adapter})"


def _arrays(maps: Maps | None) -> dict[str, Map]:
    return {name: np.asarray(array, dtype=np.float32) for name, array in (maps or {}).items()}
