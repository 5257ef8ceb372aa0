"""What the wheel says of itself: all that pyproject.toml does, as maturin writes it."""

import re
import shutil
import subprocess
import sys
import zipfile
from email.message import Message
from email.parser import Parser
from pathlib import Path
from typing import Any

import pytest

from conftest import NotChecked

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return found


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """A wheel of a library that is none."""
    folder = tmp_path_factory.mktemp("wheel")
    library, player = folder / "library.so", folder / "player.html"
    library.write_bytes(b"a library")
    player.write_text("a page")
    words = [sys.executable, str(HERE / "pack.py"), str(library), str(folder / "out"), str(player)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return zipfile.ZipFile(done.stdout.strip())


def info(wheel: zipfile.ZipFile, name: str) -> str:
    (place,) = (place for place in wheel.namelist() if place.endswith(f".dist-info/{name}"))
    return wheel.read(place).decode()


def test_the_packed_metadata_has_all_that_the_project_says(packed: zipfile.ZipFile, project: dict[str, Any]) -> None:
    metadata = Parser().parsestr(info(packed, "METADATA"))
    assert metadata["Name"] == project["name"] and metadata["Summary"] == project["description"]
    assert metadata["License-Expression"] == project["license"]
    assert metadata["Requires-Python"] == project["requires-python"]
    assert metadata["Keywords"].split(",") == project["keywords"]
    extras = project["optional-dependencies"]
    assert sorted(metadata.get_all("Provides-Extra", [])) == sorted(extras)
    wanted = [*project["dependencies"], *(f"{one} ; extra == '{name}'" for name, many in extras.items() for one in many)]
    assert sorted(metadata.get_all("Requires-Dist", [])) == sorted(wanted)
    # Whoever installs it has NumPy with it, and nothing else.
    assert [re.split("[<>=]", one)[0] for one in metadata.get_all("Requires-Dist", []) if "extra" not in one] == ["numpy"]


def test_the_wheel_has_every_file_of_the_package(packed: zipfile.ZipFile) -> None:
    names = set(packed.namelist())
    sources = {f"skinfit/{file.name}" for file in (HERE / "package/skinfit").glob("*.py*")}
    assert sources | {"skinfit/py.typed", "skinfit/player.html"} <= names
    recorded = {line.split(",")[0] for line in info(packed, "RECORD").splitlines()}
    assert recorded == names


def test_it_says_what_maturin_writes(packed: zipfile.ZipFile, tmp_path: Path, not_checked: NotChecked) -> None:
    maturin = Path(sys.executable).with_name("maturin")
    if not maturin.is_file() or shutil.which("cargo") is None:
        not_checked("there is no maturin or no cargo, so the packed METADATA was not compared with maturin's")
        pytest.skip("NOT CHECKED: no maturin or no cargo")
    # It reads manifests, and compiles nothing.
    words = [str(maturin), "pep517", "write-dist-info", "--metadata-directory", str(tmp_path)]
    words += ["--interpreter", sys.executable]
    subprocess.run(words, cwd=HERE, check=True, capture_output=True)
    (written,) = tmp_path.glob("*.dist-info")

    def lines(metadata: Message) -> list[tuple[str, str]]:
        return sorted((name, value) for name, value in metadata.items() if name != "Metadata-Version")

    assert lines(Parser().parsestr(info(packed, "METADATA"))) == lines(
        Parser().parsestr((written / "METADATA").read_text(encoding="utf-8"))
    )
    scripts = (written / "entry_points.txt").read_text(encoding="utf-8")
    assert scripts.replace(" ", "").split() == info(packed, "entry_points.txt").replace(" ", "").split()
    tags = re.findall("^Tag: (.*)$", (written / "WHEEL").read_text(encoding="utf-8"), re.MULTILINE)
    assert [tag.split("-")[:2] for tag in tags] == [["cp310", "abi3"]]
    assert "Tag: cp310-abi3-" in info(packed, "WHEEL")
