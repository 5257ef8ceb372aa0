"""The examples of docstrings and of docs/python.md run; PyTorch's do in `test_torch.py`."""

import doctest
import importlib
import pkgutil
import re
import shutil
from pathlib import Path

import pytest
import skinfit

DOCS = Path(__file__).resolve().parents[3] / "docs/python.md"
MODULES = {module.name for module in pkgutil.iter_modules(skinfit.__path__) if not module.name.startswith("_")}
# What the others are made of: nobody has to call these, so they need no example.
INNER = {"command", "described", "errors", "exr", "given", "html", "mesh", "options", "progress", "running", "scratch"}


@pytest.mark.parametrize("name", ["", *sorted(MODULES - {"torch", "maps"})])
def test_the_examples_of_docstrings_run(name: str, cache: Path, unwarned: None) -> None:
    assert run_docstrings(f"skinfit.{name}" if name else "skinfit") > 0 or name in INNER


def test_the_examples_of_maps_run(adapter: None, unwarned: None) -> None:
    assert run_docstrings("skinfit.maps") > 0


def run_docstrings(module: str) -> int:
    """Run a module's examples, none of which may fail: how many lines there were."""
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed, attempted = doctest.testmod(importlib.import_module(module), optionflags=flags)
    assert failed == 0
    return attempted


def run_blocks(torch: bool) -> int:
    """Run the page's examples, from the first to the last, that use PyTorch or do not: how many there are."""
    found = re.findall(r"^```python\n(.*?)^```$", DOCS.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    blocks = [block for block in found if ("torch" in block) == torch]
    there: dict[str, object] = {}
    for number, block in enumerate(blocks):
        exec(compile(block, f"{DOCS.name}, block {number + 1}", "exec"), there)
    return len(blocks)


def test_the_examples_of_the_page_run_from_the_first_to_the_last(
    small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unwarned: None
) -> None:
    shutil.copytree(small_file.parent, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    assert run_blocks(torch=False) >= 2
