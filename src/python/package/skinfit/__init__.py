"""Fit the constants of a real-time skin shader to images.

    import skinfit

    scene = skinfit.load_file("scene.toml")    # or load_dict(...), demo()
    print(scene.params)                        # the parameter table
    found = scene.fit()                        # the command line's fit, to the bit
    print(found.params, found.std_errors)
    scene.params.set_all(found.params)
    image = scene.render("front").image        # (height, width, 3) float32, linear Rec.709

The built-in scene needs no file:

    >>> import skinfit
    >>> scene = skinfit.demo()
    >>> scene.params["rim_exponent"] = 3.0
    >>> scene.render("front").image.shape
    (320, 320, 3)

Images are linear Rec.709 radiance, premultiplied by coverage, row by row from the top; angles are degrees, lengths the
scene's own. What is refused raises an `Error` of a class a kind, with a paragraph on what to do; Ctrl-C ends what is under
way; other threads go on meanwhile. `skinfit.torch` and `skinfit.jax` have the same as functions of PyTorch's and JAX's.
"""

from . import _native

# Builds of the model are told apart by this file, not by Python's.
_native.loaded_from(_native.__file__)

from .errors import (  # noqa: E402
    ArrayError,
    BakeError,
    DeviceError,
    Error,
    Fault,
    FileError,
    FitError,
    ParamError,
    SceneError,
    SkinError,
    SkinfitWarning,
    StudyError,
    ViewError,
)
from .fit import FitSteps, Step, fit, fit_steps  # noqa: E402
from .found import Fit, Iteration, Scores, load_run  # noqa: E402
from .loading import demo, load_dict  # noqa: E402
from .maps import MapGradients, MapObjective  # noqa: E402
from .objective import NormalEquations, Objective  # noqa: E402
from .options import FitOptions  # noqa: E402
from .page import Page  # noqa: E402
from .params import ParamInfo, Params  # noqa: E402
from .rendering import Rendering  # noqa: E402
from .scene import Scene, View, load_file  # noqa: E402
from .study import Study, ablate, stability, tradeoff  # noqa: E402
from .table import Table  # noqa: E402

__version__ = _native.version()

__all__ = [
    "ArrayError",
    "BakeError",
    "DeviceError",
    "Error",
    "Fault",
    "FileError",
    "Fit",
    "FitError",
    "FitOptions",
    "FitSteps",
    "Iteration",
    "MapGradients",
    "MapObjective",
    "NormalEquations",
    "Objective",
    "Page",
    "ParamError",
    "ParamInfo",
    "Params",
    "Rendering",
    "Scene",
    "SceneError",
    "Scores",
    "SkinError",
    "SkinfitWarning",
    "Step",
    "Study",
    "StudyError",
    "Table",
    "View",
    "ViewError",
    "ablate",
    "demo",
    "fit",
    "fit_steps",
    "load_dict",
    "load_file",
    "load_run",
    "stability",
    "tradeoff",
]
