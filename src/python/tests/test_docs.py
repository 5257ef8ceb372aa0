"""The examples of docstrings and of docs/python.md run."""

import doctest
import importlib.util
import pkgutil
import re
import shutil
from pathlib import Path

import pytest
import skinfit

from conftest import NotChecked

DOCS = Path(__file__).resolve().parents[3] / "docs/python.md"
MODULES = sorted(module.name for module in pkgutil.iter_modules(skinfit.__path__) if not module.name.startswith("_"))


@pytest.mark.parametrize("name", ["", *MODULES])
def test_the_examples_of_docstrings_run(name: str, cache: Path, not_checked: NotChecked, unwarned: None) -> None:
    try:
        module = importlib.import_module(f"skinfit.{name}") if name else skinfit
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        not_checked(f"examples of skinfit.{name}: PyTorch is not installed")
        pytest.skip("PyTorch is not installed")
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed, _ = doctest.testmod(module, optionflags=flags)
    assert failed == 0


def blocks() -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", DOCS.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def test_the_examples_of_the_page_run_from_the_first_to_the_last(
    small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, not_checked: NotChecked, unwarned: None
) -> None:
    shutil.copytree(small_file.parent, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    there: dict[str, object] = {}
    assert len(blocks()) >= 2
    for number, block in enumerate(blocks()):
        if "torch" in block and importlib.util.find_spec("torch") is None:
            not_checked(f"block {number + 1} of {DOCS.name}: PyTorch is not installed")
            continue
        exec(compile(block, f"{DOCS.name}, block {number + 1}", "exec"), there)
