"""Studies return tables and plots; what the command line refuses is raised."""

import inspect
import math
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import skinfit
from skinfit.study import AblateOptions, StabilityOptions, TradeoffOptions
from skinfit.table import Table, read_csv


def test_an_ablation_is_a_table(small: skinfit.Scene, tmp_path: Path, unwarned: None) -> None:
    found = small.fit(engine="cpu")
    study = small.ablate(gpu="never", params=found.run / "params.toml")
    rows = study.rows()
    assert {"left_out", "view", "loss", "psnr_db"} <= set(rows[0])
    assert {"rim", "hilite"} <= {row["left_out"] for row in rows}
    assert all(isinstance(row["loss"], float) for row in rows)
    assert len(study.table) == len(rows) and "left out" in repr(study)
    assert (study.save(tmp_path / "kept") / "report.html").is_file()


def test_a_tradeoff_has_a_plot_for_each_axis(small: skinfit.Scene, unwarned: None) -> None:
    study = small.tradeoff(axes="filter")
    assert list(study.plots) == ["filter"] and "<svg" in study.plots["filter"]
    assert all(row["axis"] == "filter" for row in study.rows())
    assert "<iframe" in study._repr_html_()
    with pytest.raises(skinfit.StudyError, match="unknown axis"):
        small.tradeoff(axes=["fliter"])


def test_a_study_of_stability_has_a_row_for_each_case(small: skinfit.Scene, unwarned: None) -> None:
    study = small.stability(gpu=False, cases=10, pixels=1000)
    rows = study.rows()
    assert not study.failed and all(row["failure"] is None for row in rows)
    assert {row["search"] for row in rows} == {"hard", "random", "lights", "scene"}
    assert "<table" in study._repr_html_()


def test_a_study_of_no_scene_is_refused_at_once(small: skinfit.Scene, tmp_path: Path) -> None:
    wrongs: list[Any] = [[], [None], [small.path], small]
    for study in (skinfit.ablate, skinfit.tradeoff, skinfit.stability):
        for wrong in wrongs:
            with pytest.raises(skinfit.StudyError, match="no scene|no list of scenes"):
                study(wrong, run=tmp_path / "run")
    with pytest.raises(skinfit.StudyError, match="no name"):
        small.tradeoff(axes=[3])  # type: ignore[list-item]
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("function", "options"),
    [
        (skinfit.ablate, AblateOptions),
        (skinfit.tradeoff, TradeoffOptions),
        (skinfit.stability, StabilityOptions),
    ],
)
def test_a_scenes_studies_take_typed_options(function: Callable[..., skinfit.Study], options: type) -> None:
    asked = inspect.signature(function).parameters.values()
    assert set(options.__annotations__) == {of.name for of in asked if of.kind is of.KEYWORD_ONLY}
    method = getattr(skinfit.Scene, function.__name__)
    assert method.__annotations__["options"] == f"Unpack[{options.__name__}]"
    for fit in (skinfit.Scene.fit, skinfit.Scene.fit_steps):
        assert fit.__annotations__["options"] == "Unpack[FitOptions]"


def test_changed_values_go_into_a_study(scene: skinfit.Scene, tmp_path: Path) -> None:
    scene.params["rim_exponent"] = 3.0
    file = scene._file(tmp_path)
    assert file != scene.path and "rim_exponent = 3" in file.read_text()
    assert skinfit.load_file(scene.path)._file(tmp_path) == scene.path


@pytest.mark.skipif(sys.platform == "win32", reason="there is no such signal")
def test_ctrl_c_ends_a_study(demo_file: Path, tmp_path: Path) -> None:
    script = textwrap.dedent(
        f"""
        import signal, skinfit
        # Of what a shell runs in the background Ctrl-C is ignored, until somebody says otherwise.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        scene = skinfit.load_file({str(demo_file)!r})
        print("begun", flush=True)
        try:
            scene.tradeoff(run={str(tmp_path / "run")!r})
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        """
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "begun\n"
        time.sleep(2.0)
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
    # It leaves nothing where it had nothing.
    assert not (tmp_path / "run").exists() or any((tmp_path / "run").glob("results.*"))


def test_a_table_is_a_list_of_rows(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("name,n,x,on\na,1,2.5,true\nb,,1e-3,false\n")
    table = Table(read_csv(tmp_path / "a.csv"))
    assert table[0] == {"name": "a", "n": 1, "x": 2.5, "on": True} and table.column("n") == [1, None]
    (tmp_path / "b.csv").write_text("view,left_out,setting,loss,n\n01,1_0,64,1_0,+2\ntrue,nan,1e3,-inf,\n")
    rows = read_csv(tmp_path / "b.csv")
    assert rows[0] == {"view": "01", "left_out": "1_0", "setting": "64", "loss": "1_0", "n": 2}
    assert rows[1] == {"view": "true", "left_out": "nan", "setting": "1e3", "loss": -math.inf, "n": None}
    assert len(table[1:]) == 1 and repr(table).splitlines()[0].split() == ["name", "n", "x", "on"]
    assert "<td>2.5</td>" in table._repr_html_()
