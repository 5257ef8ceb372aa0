#!/usr/bin/env python3
"""Pack the wheel of a library that is compiled already, as one that `cargo test --workspace` has made of the parts that all
else there is made of: `pack.py LIBRARY FOLDER [PLAYER]` prints the wheel's path. With the page without a scene that
`src/page/build` has made, `PLAYER`, the wheel can write pages by itself.

`pip install ./src/python` compiles by itself; the two wheels hold the same files, and say the same of themselves.
Before Python 3.11 it takes tomli, which pytest and mypy bring.
"""

import base64
import csv
import hashlib
import io
import re
import sys
import sysconfig
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).resolve().parent
PACKAGE = HERE / "package"
# The oldest Python that it is for: `abi3-py310` in Cargo.toml.
ABI = "cp310-abi3"


def version() -> str:
    """The workspace's version."""
    workspace: str = read("../../Cargo.toml")["workspace"]["package"]["version"]
    return workspace


def read(manifest: str) -> dict[str, Any]:
    """A manifest beside this file."""
    return tomllib.loads((HERE / manifest).read_text(encoding="utf-8"))


def metadata() -> dict[str, str]:
    """The files of the wheel's .dist-info, but for RECORD: what maturin writes of pyproject.toml."""
    project = read("pyproject.toml")["project"]
    scripts = "".join(f"{name} = {function}\n" for name, function in project["scripts"].items())
    return {
        "METADATA": "".join(f"{name}: {value}\n" for name, value in described(project)),
        "WHEEL": f"Wheel-Version: 1.0\nGenerator: skinfit\nRoot-Is-Purelib: false\nTag: {tag()}\n",
        "entry_points.txt": f"[console_scripts]\n{scripts}",
    }


def described(project: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """METADATA, line by line. Raises for what is in pyproject.toml and has no line here."""
    known = {
        "name", "description", "requires-python", "license", "dependencies", "dynamic", "keywords", "optional-dependencies",
        "scripts",
    }
    if project.keys() - known or project["dynamic"] != ["version"]:
        raise SystemExit(f"pack.py: it does not know what to do with {project.keys() - known or project['dynamic']}")
    yield "Metadata-Version", "2.4"
    yield "Name", project["name"]
    yield "Version", version()
    for requirement in project["dependencies"]:
        yield "Requires-Dist", requirement
    for extra, requirements in sorted(project["optional-dependencies"].items()):
        for requirement in requirements:
            yield "Requires-Dist", f"{requirement} ; extra == '{extra}'"
        yield "Provides-Extra", extra
    yield "Summary", project["description"]
    yield "Keywords", ",".join(project["keywords"])
    yield "License-Expression", project["license"]
    yield "Requires-Python", project["requires-python"]


def tag() -> str:
    """What the wheel runs on."""
    return f"{ABI}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def files(library: Path, player: Path | None) -> dict[str, bytes]:
    """Every file of the wheel, by its name in it."""
    sources = (path for path in sorted(PACKAGE.rglob("*")) if path.is_file() and "__pycache__" not in path.parts)
    found = {path.relative_to(PACKAGE).as_posix(): path.read_bytes() for path in sources}
    ending = "pyd" if sys.platform == "win32" else "abi3.so"
    found[f"skinfit/_native.{ending}"] = library.read_bytes()
    if player is not None:
        found["skinfit/player.html"] = player.read_bytes()
    info = f"skinfit-{version()}.dist-info"
    found |= {f"{info}/{name}": text.encode() for name, text in metadata().items()}
    record = io.StringIO()
    rows = csv.writer(record, lineterminator="\n")
    for name, content in found.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        rows.writerow([name, f"sha256={digest}", len(content)])
    rows.writerow([f"{info}/RECORD", "", ""])
    found[f"{info}/RECORD"] = record.getvalue().encode()
    return found


def main() -> None:
    if len(sys.argv) not in (3, 4):
        raise SystemExit("usage: pack.py LIBRARY FOLDER [PLAYER]")
    library, folder, *player = map(Path, sys.argv[1:])
    folder.mkdir(parents=True, exist_ok=True)
    wheel = folder / f"skinfit-{version()}-{tag()}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as packed:
        for name, content in files(library, player[0] if player else None).items():
            packed.writestr(name, content)
    print(wheel)


main()
