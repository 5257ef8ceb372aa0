"""Tables without pandas are the package's own. `src/python/test` has these run where there is none, too."""

import sys
from pathlib import Path

import pytest
import skinfit


@pytest.fixture(autouse=True)
def without_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    # Where it is installed, importing it fails as where it is not.
    monkeypatch.setitem(sys.modules, "pandas", None)


def test_tables_are_lists_of_rows(small_file: Path, cache: Path) -> None:
    found = skinfit.load_file(small_file, cache=cache).fit(engine="cpu")
    table = found.unknowns
    assert type(table) is skinfit.Table and table.column("name") == list(found.std_errors)
    assert table[0] == found.report["unknowns"][0]
    assert "<table>" in table._repr_html_()


def test_a_study_is_one(tmp_path: Path) -> None:
    (tmp_path / "results.csv").write_text("axis,error,on\nfilter,0.5,true\nfilter,,false\n")
    table = skinfit.Study(tmp_path, "", False, None).table
    assert type(table) is skinfit.Table and table[1] == {"axis": "filter", "error": None, "on": False}
