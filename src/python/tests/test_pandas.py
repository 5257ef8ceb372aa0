"""Tables are pandas' where it is installed, which it is in the environment that runs these."""

from pathlib import Path

import pandas
import skinfit
from skinfit.table import best


def test_tables_are_data_frames(small_file: Path, cache: Path) -> None:
    found = skinfit.load_file(small_file, cache=cache).fit(engine="cpu")
    table = found.unknowns
    assert isinstance(table, pandas.DataFrame) and list(table["name"]) == list(found.std_errors)
    assert table["value"].dtype == float and len(table) == len(found.report["unknowns"])


def test_a_study_is_one(tmp_path: Path) -> None:
    (tmp_path / "results.csv").write_text("axis,error,on\nfilter,0.5,true\nexact,,false\n")
    study = skinfit.Study(tmp_path, "", False, None)
    table = study.table
    assert isinstance(table, pandas.DataFrame) and list(table.columns) == ["axis", "error", "on"]
    assert table["error"].isna().tolist() == [False, True] and table["on"].tolist() == [True, False]
    assert "filter" in study._repr_html_()


def test_no_rows_are_a_table_too() -> None:
    assert best([]).empty
