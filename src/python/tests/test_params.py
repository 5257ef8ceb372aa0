"""The parameters: a mapping whose rows are the library's own."""

from pathlib import Path

import numpy as np
import pytest
import skinfit


def test_the_table_has_a_row_for_each_parameter(scene: skinfit.Scene) -> None:
    table = repr(scene.params)
    assert table.splitlines()[0].split() == ["name", "value", "default", "bounds", "unit", "free"]
    assert [line.split()[0] for line in table.splitlines()[1:]] == list(scene.params)
    assert len(scene.params) == len(scene.params.rows()) > 5
    row = scene.params.info("rim_exponent")
    assert row.bounds == (0.25, 16.0) and row.default == 2.0 and not row.linear and row.meaning
    assert "<table>" in scene.params._repr_html_()


def test_values_are_set_as_one_or_by_channel(scene: skinfit.Scene) -> None:
    scene.params["hilite"] = 0.5
    assert scene.params["hilite"] == 0.5
    scene.params["hilite"] = (0.7, 0.6, 0.5)
    assert scene.params["hilite"] == (0.7, 0.6, 0.5)
    scene.params.reset("hilite")
    assert scene.params.get("hilite") == scene.params.info("hilite").default
    assert scene.params.get(3, 1.0) == 1.0 and 3 not in scene.params  # type: ignore[call-overload]
    scene.params["hilite"] = np.float32(0.5)
    scene.params["hilite"] = np.array([0.5, 0.25, 0.125], dtype=np.float32)
    assert scene.params["hilite"] == (0.5, 0.25, 0.125)
    scene.params.reset("hilite")
    assert scene.params.get("nothing") is None and "nothing" not in scene.params
    scene.params.set_all({"hilite": 0.25})
    assert scene.params["hilite"] == 0.25


def test_what_a_fit_has_found_is_taken_over(small: skinfit.Scene) -> None:
    own = small.path.parent.name
    before = dict(small.params)
    # Of this scene, of another one, and of an effect that is off here.
    found = {f"{own}/hilite": 0.3, "hilite": 0.9, "other/hilite": 0.7, "rim_weight": 0.4, "reflection": 0.2}
    small.params.set_all(found)
    assert dict(small.params) == {**before, "hilite": 0.3, "rim_weight": 0.4}
    small.params.set_all(before)
    for wrong, words in [
        ({"rim_weight": 0.1, "hilight": 0.5}, "Did you mean `hilite`"),
        ({"rim_weight": 0.1, "other/hilight": 0.5}, "Did you mean `hilite`"),
        ({"rim_weight": 0.1, "hilite": -1.0}, "hilite"),
        ({"rim_weight": 0.1, 3: 1.0}, "no name"),
        ([("rim_weight", 0.1)], "no mapping"),
    ]:
        with pytest.raises(skinfit.ParamError, match=words):
            small.params.set_all(wrong)  # type: ignore[arg-type]
        assert dict(small.params) == before


def freedoms(scene: skinfit.Scene) -> dict[str, str]:
    return {row.name: row.free for row in scene.params.rows()}


def test_what_is_refused_leaves_everything_free_as_it_was(small: skinfit.Scene) -> None:
    before, rows = freedoms(small), small.params.rows()
    for change in (
        lambda: small.params.free_only("hilite", "base_wieght"),
        lambda: small.params.free_only("hilite", per_channel=["rim_exponent"]),
        lambda: small.params.free("hilite", "base_wieght", per_channel=True),
        lambda: small.params.fix("hilite", "base_wieght"),
        lambda: small.params.free("hilite", "\ud800"),
        lambda: small.params.set_all({"hilite": (0.1, 0.2, 0.3), "base_weight": -1.0}),
        lambda: small.params.free(["hilite"]),  # type: ignore[arg-type]
        lambda: small.params.bound("hilite", "abc"),  # type: ignore[arg-type]
        lambda: small.params.bound("hilite", (0.1, 0.2)),  # type: ignore[arg-type]
    ):
        with pytest.raises(skinfit.ParamError):
            change()
        assert freedoms(small) == before and small.params.rows() == rows


def test_one_name_is_a_list_of_one(small: skinfit.Scene) -> None:
    small.params.free_only("rim_weight", per_channel="hilite")
    assert small.objective().names == ["rim_weight", "hilite.r", "hilite.g", "hilite.b"]


def test_nothing_of_effects_that_are_off_stays_free(small: skinfit.Scene, cache: Path, unwarned: None) -> None:
    plain = skinfit.load_file(small.path, effects=["diffuse", "hilite"], cache=cache)
    plain.params.fix()
    plain.params.free("hilite")
    assert plain.objective().names == ["hilite"]
    plain.params.free_only("base_weight")
    assert plain.objective().names == ["base_weight"]
    assert plain.copy().objective().names == ["base_weight"]


def test_what_a_fit_moves_is_said_by_name(scene: skinfit.Scene) -> None:
    scene.params.free_only("base_weight", per_channel=["hilite"])
    assert scene.objective().names == ["base_weight", "hilite.r", "hilite.g", "hilite.b"]
    scene.params.fix("hilite")
    assert scene.params.info("hilite").free == "fixed"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("hilight", 0.5, "Did you mean `hilite`"),
        ("hilite", -1.0, "hilite"),
        ("hilite", float("nan"), "hilite"),
        ("rim_exponent", (1.0, 2.0, 3.0), "one value"),
        ("hilite", (1.0, 2.0), "hilite"),
        ("hilite", "abc", "hilite: holds words"),
        ("hilite", "0.5", "words"),
        ("hilite", b"1", "bytes"),
        ("hilite", None, "no numbers"),
        ("hilite", True, "truth values"),
        ("hilite", 1j, "complex"),
        ("hilite", [], "shape"),
        ("hilite", [[0.1, 0.2, 0.3]], "shape"),
        ("hilite", [0.1, [0.2]], "hilite"),
        (3, 0.5, "3 is no name"),
    ],
)
def test_a_wrong_name_or_value_is_a_param_error(scene: skinfit.Scene, name: str, value: object, words: str) -> None:
    before = dict(scene.params)
    with pytest.raises(skinfit.ParamError, match=words):
        scene.params[name] = value  # type: ignore[assignment]
    assert dict(scene.params) == before


def test_what_has_one_value_is_not_free_by_channel(scene: skinfit.Scene) -> None:
    with pytest.raises(skinfit.ParamError, match="one value"):
        scene.params.free("rim_exponent", per_channel=True)
    with pytest.raises(TypeError):
        del scene.params["hilite"]
