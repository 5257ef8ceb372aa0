"""How far a fit is: a line that changes, in a notebook or on a terminal."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .fit import Step


class Progress:
    """The line. `shown=None`: where a notebook or a terminal shows it."""

    def __init__(self, shown: bool | None) -> None:
        self._handle: Any = None
        self._notebook = shown is not False and _in_notebook()
        self._terminal = not self._notebook and (sys.stderr.isatty() if shown is None else shown)
        self._length = 0

    def begin(self) -> None:
        """Show that there is no step yet."""
        self._show("fit: scenes are read, baked and sampled")

    def step(self, step: Step) -> None:
        """Show a step."""
        self._show(f"fit: {step.iteration} iterations, {step.evaluations} passes, loss {step.loss:.6e}")

    def _show(self, line: str) -> None:
        if self._notebook:
            self._display(line)
        elif self._terminal:
            print("\r" + line.ljust(self._length), end="", file=sys.stderr, flush=True)
            self._length = len(line)

    def close(self) -> None:
        """Leave the line as it is."""
        if self._terminal and self._length:
            print(file=sys.stderr)

    def _display(self, line: str) -> None:
        from IPython.display import display

        shown = _Line(line)
        if self._handle is None:
            self._handle = display(shown, display_id=True)
        else:
            self._handle.update(shown)


class _Line:
    """Words that a notebook shows without quotes."""

    def __init__(self, words: str) -> None:
        self._words = words

    def __repr__(self) -> str:
        return self._words


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    if shell is None:
        return False
    # Jupyter's, or one that is made of it, as Colab's.
    return any(kind.__name__ == "ZMQInteractiveShell" for kind in type(shell.get_ipython()).__mro__)
