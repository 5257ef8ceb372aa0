"""Pages of fits and scenes, and how a notebook frames them. `test_browser.py` opens them."""

import base64
import html
from pathlib import Path

import pytest
import skinfit


@pytest.fixture
def player(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What takes a scene and a title, as the player does."""
    file = tmp_path / "player.html"
    file.write_text("<title>{{title}}</title><p id=scene>{{scene}}</p>")
    monkeypatch.setenv("SKINFIT_PLAYER", str(file))
    return file


def scene_in(text: str) -> bytes:
    return base64.b64decode(text.split("<p id=scene>")[1].split("</p>")[0])


def test_a_fit_is_a_page(small: skinfit.Scene, player: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = small.fit(engine="cpu")
    page = found.page()
    assert page.file == found.run / "page.html" and "page.html" in (found.run / "report.html").read_text()
    text = page.file.read_text(encoding="utf-8")
    # It holds an archive, packed by gzip.
    assert scene_in(text)[:2] == b"\x1f\x8b"
    # What is not below the working folder is within the frame.
    assert f'<iframe srcdoc="{html.escape(text)[:40]}' in page._repr_html_()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a folder").mkdir()
    below = found.page("a folder/skin.html", player=player, title="Mine & yours")
    assert below._repr_html_().startswith('<iframe src="a%20folder/skin.html"')
    assert "<title>Mine &amp; yours</title>" in below.file.read_text(encoding="utf-8")


def test_a_scene_is_a_page_at_its_values(small: skinfit.Scene, player: Path) -> None:
    before = small.page()
    plain = scene_in(before.file.read_text())
    small.params["rim_exponent"] = 3.0
    page = small.page()
    assert page.file.is_file() and repr(page) == f"Page({str(page.file)!r})"
    assert scene_in(page.file.read_text()) != plain


def test_without_a_player_it_is_told_how_to_make_one(small: skinfit.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SKINFIT_PLAYER", raising=False)
    monkeypatch.setattr("skinfit.page.PLAYER", Path("nowhere/player.html"))
    with pytest.raises(skinfit.FileError, match="src/page/build"):
        small.page()
    with pytest.raises(skinfit.FileError, match="cannot be read"):
        small.page(player="nowhere.html")


def test_a_rendering_is_a_picture_in_a_notebook(small: skinfit.Scene) -> None:
    png = small.render()._repr_png_()
    assert png.startswith(b"\x89PNG") and png[16:24] == (48).to_bytes(4, "big") + (40).to_bytes(4, "big")
