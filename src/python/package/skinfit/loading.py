"""Scenes that are made here: of a dictionary with arrays, and the built-in one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from . import _native
from .described import describe
from .given import FilePath, Names
from .scene import Cache, Scene, cache_folder, read
from .scratch import Scratch, named_or_own


def load_dict(
    scene: Mapping[str, Any],
    *,
    folder: FilePath | None = None,
    effects: Names | None = None,
    cache: Cache = True,
) -> Scene:
    """Read a scene that is given as a dictionary with a scene file's keys.

    Where a scene file names a file, an array of floating-point numbers may stand, which is kept as float32:

    - images as (height, width), (height, width, 3) or, with coverage, (height, width, 4), in linear Rec.709:
      `environment.file` (a lat-long panorama), `maps.color`, and of a view `target` (premultiplied where it has coverage)
      and `haze` (one number a pixel). `maps.normal`, `.specular`, `.attenuator` and `.own` are numbers as they are, a
      normal's and a share's in [0, 1], as is a view's `mask`, which may be of truth values;
    - `mesh.file` as a dictionary of `positions` (V, 3), `triangles` (T, 3) of indices, `uvs` (V, 2) with the origin in the
      image's upper left corner, and `normals` (V, 3) if there are any, in the scene's units;
    - a view's `response` as a table (n,) or (n, 3) of light.

    Codes of 8 or 16 bits are refused, as an array does not say whether they have a curve: name the picture's file, or
    divide and linearise them. Light below zero is taken as a scene file's is: of an environment it becomes 0, with a
    warning; a target keeps it.

    Arrays are written into `folder`, which is made if need be, beside the scene as `scene.toml`; without one into a
    folder that goes with the scene, and that `Scene.save` and `Fit.save` copy. A folder that has another scene is refused;
    the same may be written again. Paths are relative to the working folder. Raises `ArrayError` for arrays of other
    shapes and numbers, `SceneError` as `load_file` does.

    >>> import numpy as np, skinfit
    >>> square = {
    ...     "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
    ...     "uvs": [[0, 1], [1, 1], [1, 0], [0, 0]],
    ...     "triangles": [[0, 1, 2], [0, 2, 3]],
    ... }
    >>> look = {"name": "front", "eye": [0, 0, 3], "look_at": [0, 0, 0], "fov_y_degrees": 50, "width": 8, "height": 6}
    >>> scene = skinfit.load_dict({
    ...     "mesh": {"file": square},
    ...     "environment": {"file": np.ones((4, 8))},
    ...     "model": {"effects": ["diffuse"], "params": {"base_weight": 0.5}},
    ...     "view": [look],
    ... })
    >>> scene.render().image[3, 4].round(3).tolist()
    [0.5, 0.5, 0.5]
    """
    place, scratch = named_or_own(folder, "scene")
    new = describe(scene, place)
    try:
        return read(place / "scene.toml", cache_folder(cache), effects, scratch)
    except BaseException:
        # Where it is mended, and written there again, it is no other scene's place.
        for file in new:
            file.unlink(missing_ok=True)
        raise


def demo(folder: FilePath | None = None, *, effects: Names | None = None, cache: Cache = True) -> Scene:
    """The built-in scene: a head that skinfit makes, whose targets its own model has drawn. Its files are kept below
    `folder`, by default the cache.

    >>> import skinfit
    >>> scene = skinfit.demo()
    >>> scene.params["rim_exponent"]
    2.0
    """
    kept_bakes = cache_folder(cache)
    scratch = None
    if folder is None and kept_bakes is None:
        scratch = Scratch()
    place = folder or (scratch.folder if scratch is not None else kept_bakes)
    assert place is not None
    file = _native.built_in_scene(place, kept_bakes)
    return read(file, kept_bakes, effects, scratch)
