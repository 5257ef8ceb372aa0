"""A scene: read, edited, drawn and fitted."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Union

from . import _native, page, study
from .described import describe
from .errors import ArrayError, SkinfitWarning
from .fit import Fit, FitSteps, Step, fit, fit_steps
from .maps import MapObjective
from .objective import Objective
from .page import Page
from .params import Params
from .rendering import Rendering
from .study import Study

FilePath = Union[str, "PathLike[str]"]
"""A path to a file or folder."""

Cache = Union[FilePath, bool]
"""Where bakes are kept between runs: `True` for the user's cache folder (`$SKINFIT_CACHE`), `False` for nowhere."""


class View(NamedTuple):
    """A view of a scene."""

    name: str
    width: int
    """Pixels."""
    height: int
    has_target: bool
    """Whether there is an image to match: a view without one takes no part in a fit."""


class Scene:
    """A scene file with the values that were changed since it was read. The file itself is never written to.

    Made by `load_file`, `load_dict` and `demo`.
    """

    def __init__(self, native: _native.Scene, folder: tempfile.TemporaryDirectory[str] | None = None) -> None:
        self._native = native
        # Files that arrays were written to: they go with the scene.
        self._folder = folder
        self._params = Params(native)
        # What was told of it.
        self._told: set[str] = set()
        self._warn_once(native.warnings)

    @property
    def path(self) -> Path:
        """The scene's file."""
        return Path(self._native.path)

    @property
    def params(self) -> Params:
        """The parameters: a mapping from name to value, with what a fit moves. Its `repr` is the table."""
        return self._params

    @property
    def views(self) -> list[View]:
        """The scene's views."""
        return [View(*view) for view in self._native.views]

    @property
    def effects(self) -> list[str]:
        """The effects that are on; `load_file(path, effects=...)` reads the scene with others."""
        return self._native.effects

    @property
    def form(self) -> str:
        """The form of the model: `corrected` or `listing`."""
        return self._native.form

    @property
    def loss(self) -> str:
        """What a fit minimises."""
        return self._native.loss

    def render(self, view: str | None = None, terms: bool = False) -> Rendering:
        """Draw a view (the first, unless named) at the scene's values, as `skinfit render --engine cpu` does, to the bit.

        With `terms`, its layers and haze too. Numbers are float32, linear Rec.709 radiance, premultiplied by coverage.
        The first image of a view, and one after a change of what is not a weight, takes bakes and samples; others are
        quick. Raises `ViewError` where there is no such view, `SceneError` where it sees nothing of the mesh.

        >>> import skinfit
        >>> drawn = skinfit.demo().render("front", terms=True)
        >>> drawn.image.shape, drawn.image.dtype
        ((320, 320, 3), dtype('float32'))
        >>> "hilite" in drawn.layers
        True
        """
        drawn, warned = self._native.render(view, terms)
        self._warn_once(warned)
        return Rendering(**drawn)

    def fit(
        self,
        callback: Callable[[Step], Any] | None = None,
        *,
        run: FilePath | None = None,
        resume: bool = False,
        hold_out: Sequence[str] = (),
        progress: bool | None = None,
        **options: Any,
    ) -> Fit:
        """Fit what is free to the targets: `skinfit.fit` of this scene alone, where arguments and options are described."""
        return fit([self], callback, run=run, resume=resume, hold_out=hold_out, progress=progress, **options)

    def fit_steps(
        self,
        *,
        run: FilePath | None = None,
        resume: bool = False,
        hold_out: Sequence[str] = (),
        **options: Any,
    ) -> FitSteps:
        """The same fit, step by step: `skinfit.fit_steps` of this scene alone."""
        return fit_steps([self], run=run, resume=resume, hold_out=hold_out, **options)

    def objective(self, hold_out: Sequence[str] = ()) -> Objective:
        """The scene's fit as a function of what is free, at the values of now, over the views with a target that are not
        held out. Raises `SceneError` where no view has a target, `ViewError` for a name that is none."""
        native = self._native.objective(list(hold_out))
        self._warn_once(native.warnings)
        return Objective(native)

    def map_objective(
        self, *maps: str, hold_out: Sequence[str] = (), adapter: str | None = None
    ) -> MapObjective:
        """The same as a function of whole maps as well: `color`, `specular`, `attenuator`, `occlusion` (every vertex) and
        `environment` (every texel of the cubes that light is looked up in), any of them; on a graphics adapter (the fastest,
        unless part of a name is given).

        `docs/maps.md` says which scenes have such maps: `SceneError` is raised for others, `ParamError` where a constant is
        free that acts through cubes which stay, or are maps (`roughness` and `gloss`, and of `environment` `specular_lobe`),
        `DeviceError` where there is no adapter or the library was built without (`features burn`).
        """
        if not maps:
            raise ArrayError("no maps are named. Name some, or take objective(), which is of constants alone.")
        native = self._native.map_objective(list(maps), list(hold_out), adapter)
        self._warn_once(native.warnings)
        return MapObjective(native)

    def ablate(self, **options: Any) -> Study:
        """What each effect and term is worth: `skinfit.ablate` of this scene alone."""
        return study.ablate([self], **options)

    def tradeoff(self, **options: Any) -> Study:
        """What accuracy costs in time: `skinfit.tradeoff` of this scene alone."""
        return study.tradeoff([self], **options)

    def stability(self, **options: Any) -> Study:
        """Hard cases on every evaluator: `skinfit.stability` of this scene alone."""
        return study.stability([self], **options)

    def page(self, file: FilePath | None = None, *, player: FilePath | None = None, title: str | None = None) -> Page:
        """The scene at its values as a page for a browser, with sliders, images and fits: `Fit.page` says more. Without a
        `file` it goes with the `Page`."""
        scratch = page.scratch()
        place = Path(scratch.name) / "page.html" if file is None else Path(file)
        with tempfile.TemporaryDirectory(prefix="skinfit-") as changed:
            words = [str(self._file(Path(changed))), *self._cache_words()]
            return page.write([*words, *([] if title is None else [f"--title={title}"])], place, player, scratch)

    def save(self, file: FilePath) -> None:
        """Write the scene with its values as a scene file whose paths are absolute. Raises `FileError`."""
        self._native.save(file)

    def _warn_once(self, words: Sequence[str]) -> None:
        """Warn of what was not told yet."""
        for paragraph in words:
            if paragraph not in self._told:
                self._told.add(paragraph)
                warnings.warn(paragraph, SkinfitWarning, stacklevel=3)

    def _file(self, folder: Path) -> Path:
        """A file of the scene as it stands: its own, or where values were changed one in `folder` that is called the same."""
        if not self._native.is_changed:
            return self.path
        whole = self.path.absolute()
        file = folder / whole.parent.name / whole.name
        self.save(file)
        return file

    def _cache_words(self) -> list[str]:
        """Where bakes are kept, as words of a command line."""
        cache = self._native.cache
        return ["--no-cache"] if cache is None else ["--cache", str(cache)]

    def __repr__(self) -> str:
        views = ", ".join(view.name for view in self.views)
        return f"Scene({str(self.path)!r}, views {views}; effects {', '.join(self.effects)})"


def load_file(path: FilePath, *, effects: Sequence[str] | None = None, cache: Cache = True) -> Scene:
    """Read a scene file, with its targets; with other `effects` than it names if they are given.

    Raises `SceneError` with file, line, what is wrong and what to do. What was mended is a `SkinfitWarning`.

    >>> import skinfit
    >>> scene = skinfit.load_file(skinfit.demo().path)
    >>> [view.name for view in scene.views]
    ['front', 'three_quarter', 'profile']
    """
    return Scene(_native.Scene(path, _cache(cache), _list(effects)))


def load_dict(
    scene: Mapping[str, Any],
    *,
    folder: FilePath | None = None,
    effects: Sequence[str] | None = None,
    cache: Cache = True,
) -> Scene:
    """Read a scene that is given as a dictionary with a scene file's keys.

    Where a scene file names a file, an array may stand:

    - images as (height, width), (height, width, 3) or, with coverage, (height, width, 4), in linear Rec.709:
      `environment.file` (a lat-long panorama), `maps.color`, `.normal`, `.specular`, `.attenuator` and `.own`, and of a
      view `target` (premultiplied where it has coverage) and `mask`. They are kept as float32;
    - `mesh.file` as a dictionary of `positions` (V, 3), `triangles` (T, 3) of indices, `uvs` (V, 2) with the origin in the
      image's upper left corner, and `normals` (V, 3) if there are any, in the scene's units.

    Arrays are written into `folder`, which is made if need be, beside the scene as `scene.toml`; without one into a
    folder that goes with the scene. Paths are relative to the working folder. Raises `ArrayError` for arrays of other
    shapes, `SceneError` as `load_file` does.

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
    scratch = tempfile.TemporaryDirectory(prefix="skinfit-") if folder is None else None
    place = Path(scratch.name if scratch is not None else str(folder))
    file = describe(scene, place)
    return Scene(_native.Scene(file, _cache(cache), _list(effects)), scratch)


def demo(folder: FilePath | None = None, *, effects: Sequence[str] | None = None, cache: Cache = True) -> Scene:
    """The built-in scene: a head that skinfit makes, whose targets its own model has drawn. Its files are kept below
    `folder`, by default the cache.

    >>> import skinfit
    >>> scene = skinfit.demo()
    >>> scene.params["rim_exponent"]
    2.0
    """
    kept = _cache(cache)
    scratch = None
    if folder is None and kept is None:
        scratch = tempfile.TemporaryDirectory(prefix="skinfit-")
    place = folder or (scratch.name if scratch is not None else kept)
    assert place is not None
    file = _native.built_in_scene(place, kept)
    return Scene(_native.Scene(file, kept, _list(effects)), scratch)


def _cache(cache: Cache) -> FilePath | None:
    if cache is True:
        return Path(_native.default_cache())
    return None if cache is False else cache


def _list(effects: Sequence[str] | None) -> str | None:
    return None if effects is None else ",".join(effects)
