"""Folders of this process' own, and how what lies in them comes along where a scene or a run is kept."""

from __future__ import annotations

import contextlib
import filecmp
import os
import shutil
import tempfile
import uuid
import weakref
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from .errors import SceneError
from .given import FilePath

try:
    import fcntl
except ImportError:
    # Windows locks otherwise.
    fcntl = None  # type: ignore[assignment]

# Those that are there now, each with the run folders that may name its files.
_FOLDERS: dict[Path, set[Path]] = {}


class Scratch:
    """A folder that goes when nothing refers to this any more, or with the process."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="skinfit-")).resolve()
        _FOLDERS[self.folder] = set()
        weakref.finalize(self, _remove, self.folder, os.getpid())


def named_or_own(given: FilePath | None, name: str) -> tuple[Path, Scratch | None]:
    """The folder that was named; or one that is called `name`, and goes with what is handed out beside it."""
    if given is not None:
        return Path(given), None
    scratch = Scratch()
    return scratch.folder / name, scratch


def _remove(folder: Path, owner: int) -> None:
    # A process that was forked has no folders of its own.
    if os.getpid() != owner:
        return
    for run in sorted(_FOLDERS.pop(folder, ())):
        # Of a run that was edited since, or is gone, nothing is to be kept.
        with contextlib.suppress(OSError, ValueError), _locked(run) as free:
            if free:
                keep_run(run, run, [folder])
    shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def _locked(run: Path) -> Iterator[bool]:
    """Whether no fit is at work in a run folder; none begins there meanwhile. Its lock is that of the command line."""
    lock = run / ".lock"
    if fcntl is None or not lock.exists():
        yield run.is_dir()
        return
    with open(lock, "rb") as held:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True


def write(file: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_name(f".{file.name}.{uuid.uuid4().hex}")
    try:
        beside.write_bytes(content)
        os.replace(beside, file)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def place(beside: Path, folder: Path) -> list[Path]:
    """Move a scene and its files into their folder, the scene last: those that were not there. Raises `SceneError` where
    another one is there; the same may be."""
    files = sorted(beside.iterdir(), key=lambda file: (file.name == "scene.toml", file.name))
    for file in files:
        there = folder / file.name
        if there.exists() and not (there.is_file() and filecmp.cmp(file, there, shallow=False)):
            raise SceneError(
                f"{there}: another scene is in this folder already. Name another folder, or remove what is in this one."
            )
    new = [folder / file.name for file in files if not (folder / file.name).exists()]
    for file in files:
        os.replace(file, folder / file.name)
    return new


def kept(text: str, folder: Path, files: str) -> str:
    """The text of a scene file for `folder`, where it can stand without the folders of this process: each file of these
    that it names is copied into the folder `files` there, and named from there."""
    for source in _named(text, _FOLDERS):
        copied = _copied(source, folder / files)
        text = _renamed(text, source, f"{files}/{copied.name}")
    return text


def stays(run: Path, folders: Iterable[Scratch | None]) -> None:
    """Keep what a run folder needs of these folders of its scenes. While the scenes are there, the fit can be gone on with only
    by the very paths that it began with: files are copied, and named anew, when their folder goes."""
    for scratch in folders:
        if scratch is not None:
            _FOLDERS[scratch.folder].add(run.absolute())


def keep_run(run: Path, to: Path, folders: Iterable[Path] | None = None) -> None:
    """Have the scenes of a run folder, which is to be renamed `to`, stand without these folders, by default those of this
    process. Paths are absolute, as a fit is gone on with by those alone."""

    def change(text: str, file: Path) -> str:
        for source in _named(text, _FOLDERS if folders is None else folders):
            copied = _copied(source, file.with_name(f"{file.stem}_files"))
            text = _renamed(text, source, str(to.absolute() / copied.relative_to(run)))
        return text

    _change_scenes(run, change)


def copy_run(run: Path, to: Path, beside: Path) -> None:
    """Copy a run folder to `beside`, which is to be renamed `to`."""
    whole = run.resolve()

    def change(text: str, file: Path) -> str:
        for source in _below(whole, text):
            text = _renamed(text, source, str(to.absolute() / source.relative_to(whole)))
        return text

    shutil.copytree(run, beside, ignore=shutil.ignore_patterns(".lock"))
    _change_scenes(beside, change)
    keep_run(beside, to)


def _change_scenes(run: Path, change: Callable[[str, Path], str]) -> None:
    for file in [run / "scene.toml", *sorted(run.glob("scenes/*.toml"))]:
        if file.is_file():
            text = file.read_text(encoding="utf-8")
            changed = change(text, file)
            if changed != text:
                write(file, changed.encode())


def _named(text: str, folders: Iterable[Path]) -> list[Path]:
    """The files of folders that a text names."""
    return [file for folder in sorted(folders) for file in _below(folder, text)]


def _below(folder: Path, text: str) -> Iterator[Path]:
    if str(folder) in text or str(folder).replace("\\", "\\\\") in text:
        yield from (file for file in sorted(folder.rglob("*")) if file.is_file() and any(q in text for q in _quoted(file)))


def _quoted(file: Path) -> list[str]:
    """How a scene file may name it: as either kind of string, on Windows with the mark of a path that is as it stands."""
    paths = [str(file), f"\\\\?\\{file}"]
    escaped = [path.replace("\\", "\\\\").replace('"', '\\"') for path in paths]
    return [*(f"'{path}'" for path in paths), *(f'"{path}"' for path in escaped)]


def _renamed(text: str, file: Path, name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    for quoted in _quoted(file):
        text = text.replace(quoted, f'"{escaped}"')
    return text


def _copied(source: Path, folder: Path) -> Path:
    """A file in `folder` with what `source` holds, which is called the same unless another is called so."""
    number = 1
    while True:
        ending = "" if number == 1 else f"_{number}"
        file = folder / f"{source.stem}{ending}{source.suffix}"
        if not file.exists():
            write(file, source.read_bytes())
            return file
        if filecmp.cmp(source, file, shallow=False):
            return file
        number += 1
