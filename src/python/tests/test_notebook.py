"""The notebook runs from its first cell to its last, and is kept with outputs that are small, and the same anywhere."""

import json
import os
import re
import runpy
from pathlib import Path
from typing import Any

import nbformat
import pytest

from conftest import NotChecked

FOLDER = Path(__file__).resolve().parents[3] / "experiments/notebook"
KEEP: dict[str, Any] = runpy.run_path(str(FOLDER / "keep"))


def outputs(notebook: Any) -> list[Any]:
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def words(notebook: Any) -> list[str]:
    """What it says in words, a text for each output, without the numbers: another processor rounds otherwise."""
    texts = [output.get("text") or output.data.get("text/html", sorted(output.data)) for output in outputs(notebook)]
    return [re.sub(r"[-+]?\d[\d.]*(e[-+]\d+)?", "#", str(text)) for text in texts]


@pytest.fixture(scope="module")
def kept() -> Any:
    return nbformat.read(FOLDER / "fit.ipynb", as_version=4)  # type: ignore[no-untyped-call]


def test_the_notebook_runs(kept: Any, not_checked: NotChecked) -> None:
    # Where a cell fails this raises.
    notebook = KEEP["run"]()
    shown = outputs(notebook)
    pages = [output["data"]["text/html"] for output in shown if "text/html" in output.get("data", {})]
    assert any("<iframe" in page for page in pages), "the report is shown"
    said = "".join(output.get("text", "") for output in shown)
    left_out = [line for line in said.splitlines() if line.startswith("NOT CHECKED")]
    assert not left_out or os.environ.get("SKINFIT_NO_DATA_TESTS"), left_out
    for line in left_out:
        not_checked(line.removeprefix("NOT CHECKED: "))
    KEEP["keep"](notebook)
    if not left_out:
        assert words(notebook) == words(kept), "what is kept with it is of an older one: run experiments/notebook/keep"


def test_what_is_kept_is_small_and_names_no_machine(kept: Any) -> None:
    text = (FOLDER / "fit.ipynb").read_text(encoding="utf-8")
    assert len(text) < 300_000
    kinds = {kind for output in outputs(kept) for kind in output.get("data", {})}
    assert {"text/html", "image/png", "image/svg+xml"} <= kinds
    said = json.dumps([{**output, "data": {**output.get("data", {}), "image/png": ""}} for output in outputs(kept)])
    assert not re.search(r"/(tmp|home|root|work|Users)/|<iframe|0x[0-9a-f]{6}", said)
    assert all("execution" not in cell.metadata for cell in kept.cells)
    # It was run once, in order.
    counts = [cell.execution_count for cell in kept.cells if cell.cell_type == "code"]
    assert counts == list(range(1, len(counts) + 1))
