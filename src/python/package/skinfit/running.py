"""Fits that are under way in this process, by their folders: one that is given up has to end before another begins there."""

from __future__ import annotations

import threading
import weakref
from pathlib import Path

from . import _native

# Seconds that a fit which was given up may take to end: a bake goes on to its end, which the next fit then has.
_PATIENCE = 600.0


class Running:
    """A fit under way."""

    def __init__(self, native: _native.Fitting, folder: Path) -> None:
        self.native = native
        self._folder = folder.resolve()
        self._stopped = False
        # The thread that has taken the last step.
        self._taker: threading.Thread | None = None
        with _lock:
            _all.add(self)

    def taken(self) -> None:
        """This thread takes a step."""
        self._taker = threading.current_thread()

    def stop(self) -> None:
        """Have it end after its iteration."""
        self._stopped = True
        self.native.stop()

    def gives_way(self, folder: Path) -> bool:
        """Whether it is given up, where another begins in this folder: it was stopped, or this thread has left it between two
        steps, as Ctrl-C in the body of a loop does."""
        given_up = self._stopped or self._taker is threading.current_thread()
        return given_up and self._folder == folder and not self.native.is_over


# None is kept by this: what nobody refers to any more stops.
_all: weakref.WeakSet[Running] = weakref.WeakSet()
_lock = threading.Lock()


def make_way(folder: Path) -> None:
    """Wait for fits into a folder that were given up."""
    place = folder.resolve()
    with _lock:
        given_up = [running for running in _all if running.gives_way(place)]
    for running in given_up:
        running.stop()
        running.native.see_off(_PATIENCE)
