"""A fit, or a scene, as one file that a browser opens from disk: sliders, images and fits (`skinfit page`).

It is written into the player, the page without a scene, which `src/page/build` makes: the argument `player`, else what
`SKINFIT_PLAYER` names, else the package's own `player.html`, where the wheel was packed with one.

    >>> import skinfit
    >>> skinfit.demo().page(player="nowhere.html")
    Traceback (most recent call last):
        ...
    skinfit.errors.FileError: nowhere.html: ...
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from .command import PLAYER, run
from .errors import FileError, warn
from .given import FilePath
from .html import framed


class Page:
    """A page that was written. In a notebook it is shown in a frame: by its address where it lies below the working folder,
    else as a whole within the notebook, which then has its megabytes."""

    def __init__(self, file: Path, kept: object = None) -> None:
        self.file = file
        """The page."""
        # Whoever keeps the folder that it is in.
        self._kept = kept

    def __repr__(self) -> str:
        return f"Page({str(self.file)!r})"

    def _repr_html_(self) -> str:
        whole, here = self.file.resolve(), Path.cwd().resolve()
        if whole.is_relative_to(here):
            address = quote(whole.relative_to(here).as_posix())
            return f'<iframe src="{address}" style="width: 100%; height: 720px; border: 0"></iframe>'
        return framed(self.file.read_text(encoding="utf-8"))


def write(of: Sequence[str], file: Path, player: FilePath | None, kept: object = None) -> Page:
    """Write the page of a run folder or of scene files, with further words of the command line."""
    run_words = ["page", *of, "-o", str(file), "--player", str(_player(player))]
    warn(run(run_words, FileError).told)
    return Page(file, kept)


def _player(given: FilePath | None) -> Path:
    named = given or os.environ.get("SKINFIT_PLAYER")
    if named:
        return Path(named)
    if PLAYER.is_file():
        return PLAYER
    raise FileError(
        "there is no player to write the page into: the wheel was packed without one. `src/page/build` in the sources makes "
        "target/release/skinfit-page.html; name it by player=..., or by SKINFIT_PLAYER."
    )
