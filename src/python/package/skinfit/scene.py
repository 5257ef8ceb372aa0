"""A scene: read, edited, drawn and fitted."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, Union

from . import _native, page, study
from .errors import ArrayError, Error, FileError, SceneError, ViewError, warn
from .fit import FitSteps, Step, fit, fit_steps
from .found import Fit
from .given import FilePath, Names, names
from .maps import MapObjective
from .objective import Objective, view_name
from .page import Page
from .params import Params
from .rendering import Rendering
from .scratch import Scratch, kept, write
from .study import Study

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import FitOptions
    from .study import AblateOptions, StabilityOptions, TradeoffOptions

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

    def __init__(self, native: _native.Scene, folder: Scratch | None = None, effects: str | None = None) -> None:
        self._native = native
        # Files that arrays were written to: they go with the scenes that were made of them.
        self._folder = folder
        # The effects that it was read with, where they are not its file's.
        self._effects = effects
        self._params = Params(native)
        # What was told of it.
        self._told: set[str] = set()
        self._warn_once(native.warnings)

    def copy(self) -> Scene:
        """Another scene of the same file, read anew, with values of its own that are this one's now."""
        other = Scene.__new__(Scene)
        native = _native.Scene(self.path, self._native.cache, self._effects)
        other._native, other._folder, other._effects = native, self._folder, self._effects
        other._params, other._told = Params(native), set(self._told)
        other._params._take(self._params)
        return other

    def __copy__(self) -> Scene:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        return self.copy()

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        raise TypeError(
            "a scene is not pickled: it holds what the library has read. Pickle its path, or that of a file that it was "
            "saved to, and load that: skinfit.load_file(path)."
        )

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
        drawn, warned = self._native.render(view_name(view), terms)
        self._warn_once(warned)
        return Rendering(**drawn)

    def fit(
        self,
        callback: Callable[[Step], Any] | None = None,
        *,
        run: FilePath | None = None,
        resume: bool = False,
        hold_out: Names = (),
        progress: bool | None = None,
        **options: Unpack[FitOptions],
    ) -> Fit:
        """Fit what is free to the targets: `skinfit.fit` of this scene alone, where arguments and options are described."""
        held = names(hold_out, ViewError)
        return fit([self], callback, run=run, resume=resume, hold_out=held, progress=progress, **options)

    def fit_steps(
        self,
        *,
        run: FilePath | None = None,
        resume: bool = False,
        hold_out: Names = (),
        **options: Unpack[FitOptions],
    ) -> FitSteps:
        """The same fit, step by step: `skinfit.fit_steps` of this scene alone."""
        return fit_steps([self], run=run, resume=resume, hold_out=names(hold_out, ViewError), **options)

    def objective(self, hold_out: Names = ()) -> Objective:
        """The scene's fit as a function of what is free, at the values of now, over the views with a target that are not
        held out, by one name or several. Raises `SceneError` where no view has a target, `ViewError` for a name that is
        none."""
        native = self._native.objective(names(hold_out, ViewError))
        self._warn_once(native.warnings)
        return Objective(native)

    def map_objective(
        self, *maps: str, hold_out: Names = (), adapter: str | None = None
    ) -> MapObjective:
        """The same as a function of whole maps as well: `color`, `specular`, `attenuator`, `occlusion` (every vertex) and
        `environment` (every texel of the cubes that light is looked up in), any of them; on a graphics adapter (the fastest,
        unless part of a name is given).

        `docs/maps.md` says which scenes have such maps: `SceneError` is raised for others, `ParamError` where a constant is
        free that acts through a cube which is a map itself (of `environment` `specular_lobe`),
        `DeviceError` where there is no adapter or the library was built without (`features burn`).
        """
        if not maps:
            raise ArrayError("no maps are named. Name some, or take objective(), which is of constants alone.")
        native = self._native.map_objective(names(maps, ArrayError), names(hold_out, ViewError), adapter)
        self._warn_once(native.warnings)
        return MapObjective(native)

    def ablate(self, **options: Unpack[AblateOptions]) -> Study:
        """What each effect and term is worth: `skinfit.ablate` of this scene alone."""
        return study.ablate([self], **options)

    def tradeoff(self, **options: Unpack[TradeoffOptions]) -> Study:
        """What accuracy costs in time: `skinfit.tradeoff` of this scene alone."""
        return study.tradeoff([self], **options)

    def stability(self, **options: Unpack[StabilityOptions]) -> Study:
        """Hard cases on every evaluator: `skinfit.stability` of this scene alone."""
        return study.stability([self], **options)

    def page(self, file: FilePath | None = None, *, player: FilePath | None = None, title: str | None = None) -> Page:
        """The scene at its values as a page for a browser, with sliders, images and fits: `Fit.page` says more. Without a
        `file` it goes with the `Page`."""
        scratch = Scratch() if file is None else None
        place = scratch.folder / "page.html" if scratch is not None else Path(str(file))
        with tempfile.TemporaryDirectory(prefix="skinfit-") as changed:
            words = [str(self._file(Path(changed))), *self._cache_words()]
            return page.write([*words, *([] if title is None else [f"--title={title}"])], place, player, scratch)

    def save(self, file: FilePath) -> None:
        """Write the scene with its values as a scene file whose paths are absolute. Files that go with the scene, as those
        of arrays do, are copied into a folder beside it, `NAME_files`, and named from there. Raises `FileError`."""
        if self._folder is None:
            self._native.save(file)
            return
        place = Path(file)
        with tempfile.TemporaryDirectory(prefix="skinfit-") as beside:
            written = Path(beside) / "scene.toml"
            self._native.save(written)
            text = written.read_text(encoding="utf-8")
        try:
            write(place, kept(text, place.parent, f"{place.stem}_files").encode())
        except OSError as error:
            raise FileError(f"{place}: cannot be written: {error.strerror}. Name another file.") from error

    def _warn_once(self, words: Sequence[str]) -> None:
        """Warn of what was not told yet."""
        new = [paragraph for paragraph in words if paragraph not in self._told]
        self._told.update(new)
        warn(new)

    def _file(self, folder: Path) -> Path:
        """A file of the scene as it stands: its own, or where values were changed one in `folder` that is called the same."""
        if not self._native.is_changed:
            return self.path
        whole = self.path.absolute()
        file = folder / whole.parent.name / whole.name
        self._native.save(file)
        return file

    def _cache_words(self) -> list[str]:
        """Where bakes are kept, as words of a command line."""
        cache = self._native.cache
        return ["--no-cache"] if cache is None else ["--cache", str(cache)]

    def __repr__(self) -> str:
        views = ", ".join(view.name for view in self.views)
        return f"Scene({str(self.path)!r}, views {views}; effects {', '.join(self.effects)})"


def load_file(path: FilePath, *, effects: Names | None = None, cache: Cache = True) -> Scene:
    """Read a scene file, with its targets; with other `effects` than it names if they are given, one or several.

    Raises `SceneError` with file, line, what is wrong and what to do. What was mended is a `SkinfitWarning`.

    >>> import skinfit
    >>> scene = skinfit.load_file(skinfit.demo().path)
    >>> [view.name for view in scene.views]
    ['front', 'three_quarter', 'profile']
    """
    if isinstance(path, Mapping):
        raise SceneError("load_file reads a scene file. To read a scene from a dictionary, call load_dict.")
    return read(path, cache_folder(cache), effects)


def read(file: FilePath, cache: FilePath | None, effects: Names | None, folder: Scratch | None = None) -> Scene:
    """Read a scene file, which goes with the scene where it is in `folder`."""
    asked = None if effects is None else ",".join(names(effects, SceneError))
    return Scene(_native.Scene(file, cache, asked), folder, asked)


def cache_folder(cache: Cache) -> FilePath | None:
    """Where bakes are kept, if they are."""
    if cache is True:
        return Path(_native.default_cache())
    return None if cache is False else cache


def scenes_of(given: object, refused: type[Error]) -> list[Scene]:
    """The scenes of a list, of which there has to be one. Raises `refused` for anything else."""
    if isinstance(given, Scene) or not isinstance(given, Iterable):
        raise refused(f"{given!r} is no list of scenes. Give one, as [skinfit.load_file(path)].")
    scenes = list(given)
    if not scenes:
        raise refused("no scene is given. Give at least one, as [skinfit.load_file(path)].")
    for scene in scenes:
        if not isinstance(scene, Scene):
            raise refused(f"{scene!r} is no scene. Give scenes, as skinfit.load_file(path).")
    return scenes
