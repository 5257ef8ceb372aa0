"""The command line: as a program (`skinfit`, `python -m skinfit`), and in a process of its own for what a package calls.

Studies run so: Ctrl-C ends them as it ends the command line's, and leaves what that leaves.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

from . import _native
from .errors import Error

# How long a command that was interrupted may take to tidy up.
_PATIENCE = 10.0
_NAME = "skinfit: "
PLAYER = Path(__file__).resolve().parent / "player.html"
"""The page without a scene, where the wheel was packed with one."""


class Said(NamedTuple):
    """What a command left behind."""

    failed: bool
    """Whether its exit code was 1: the input was good, and the work did not go well."""
    out: str
    """Standard output."""
    told: list[str]
    """Lines of standard error: warnings and advice."""


def main() -> NoReturn:
    """Run the program on this process' words."""
    words = sys.argv[1:]
    named = any(word.split("=")[0] == "--player" for word in words)
    if words[:1] == ["page"] and PLAYER.is_file() and not named:
        words.append(f"--player={PLAYER}")
    sys.exit(_native.run_program(["skinfit", *words]))


def run(words: Sequence[str], refused: type[Error]) -> Said:
    """Run the program on these words. Raises `refused`, with the program's paragraph in Python's words, where it refuses its input."""
    command = [sys.executable, "-m", "skinfit", *words]
    with subprocess.Popen(
        command, env=_environment(), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        try:
            out, err = (text.decode("utf-8", "replace") for text in process.communicate())
        except BaseException:
            _end(process)
            raise
    told = [line.removeprefix(_NAME) for line in err.splitlines() if line]
    if process.returncode not in (0, 1):
        words = _native.in_python("\n".join(told))
        raise refused(words or f"skinfit ended with exit code {process.returncode}.")
    return Said(process.returncode == 1, out, told)


def _environment() -> dict[str, str]:
    """This process' own, by which the other finds this package."""
    here = str(Path(__file__).resolve().parent.parent)
    path = [here, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path)}


def _end(process: subprocess.Popen[bytes]) -> None:
    """Interrupt a process, and wait until it has tidied up."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
        try:
            process.communicate(timeout=_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
