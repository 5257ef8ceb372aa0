"""What skinfit raises: a class a kind, each with the paragraph that the command line prints.

A paragraph says file, place, what is wrong and what to do. All are `Error`; those that are about a value are
`ValueError` too, those about a name `LookupError`.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable


class Error(Exception):
    """Whatever skinfit raises."""


class SceneError(Error, ValueError):
    """A scene file, or a file that it names, is not sound, or a view cannot be sampled."""


class ParamError(Error, ValueError, KeyError):
    """There is no such parameter in the scene, or it may not have that value."""

    def __str__(self) -> str:
        # A KeyError would quote it.
        return Exception.__str__(self)


class ViewError(Error, LookupError):
    """The scene has no view of that name, or none is left to fit."""


class BakeError(Error, ValueError):
    """Light or occlusion cannot be baked of this scene."""


class SkinError(Error, ValueError):
    """These scenes cannot be fitted as one skin."""


class ArrayError(Error, ValueError):
    """An array has another shape or other numbers than asked for."""


class DeviceError(Error, RuntimeError):
    """There is no such graphics adapter, it has no room or was lost, or the library was built without what runs on it."""


class FitError(Error, RuntimeError):
    """A fit was refused, or failed before it found anything."""


class StudyError(Error, RuntimeError):
    """A command of the command line was refused, or failed before it had results."""


class FileError(Error, OSError):
    """A file cannot be written."""


class Fault(Error, RuntimeError):
    """Something that should not happen: a fault of skinfit's."""


class SkinfitWarning(UserWarning):
    """What the command line would print as a warning: something was mended, or left out."""


def warn(told: Iterable[str]) -> None:
    """Warn of what the library has told, where the package was called from."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    for words in told:
        warnings.warn(words.removeprefix("warning: "), SkinfitWarning, stacklevel=level)
