"""The parameters: a mapping whose rows are the library's own."""

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
    assert scene.params.get("nothing") is None and "nothing" not in scene.params
    scene.params.set_all({"hilite": 0.25, "light.of_another_scene": 1.0})
    assert scene.params["hilite"] == 0.25


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
