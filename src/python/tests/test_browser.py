"""A fit's page in headless Chromium, from the disk and within the frames that a notebook has of it. What one does with it there is
tested by the program's own tests."""

import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest
import skinfit

from conftest import NotChecked

# Sends what the page has come to once its image is drawn.
PROBE = """
<script>
const timer = setInterval(() => {
  const state = skinfit.state();
  if (!state?.image || !state.idle || state.image.psnr === null || !skinfit.pixels("now")) return;
  clearInterval(timer);
  const { width, height } = skinfit.pixels("now");
  const sliders = state.rows.flatMap((row) => row.sliders).map((slider) => [slider.name, slider.value]);
  const found = { title: document.title, psnr: state.image.psnr, width, height, sliders: Object.fromEntries(sliders) };
  fetch("ADDRESS", { method: "POST", mode: "no-cors", body: JSON.stringify(found) });
}, 50);
</script></body>"""


@pytest.fixture(scope="module")
def browser() -> str:
    names = ["chromium", "chromium-browser", "google-chrome"]
    found = next(filter(None, map(shutil.which, names)), None)
    assert found, "no browser was found: install Debian's `chromium`, or set SKINFIT_NO_BROWSER_TESTS=1"
    return found


@pytest.fixture(autouse=True)
def left_out(not_checked: NotChecked) -> None:
    if os.environ.get("SKINFIT_NO_BROWSER_TESTS"):
        not_checked("SKINFIT_NO_BROWSER_TESTS is set, so no page of Python's was opened in a browser")
        pytest.skip("SKINFIT_NO_BROWSER_TESTS is set")


@pytest.fixture
def answers() -> "Iterator[tuple[str, queue.Queue[Any]]]":
    """Where a page sends what it has found, and what was sent there."""
    sent: "queue.Queue[Any]" = queue.Queue()

    class Answer(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            sent.put(json.loads(self.rfile.read(int(self.headers["content-length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answer) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/", sent
        server.shutdown()


def opened(browser: str, file: Path, sent: "queue.Queue[Any]") -> Any:
    """What is sent by a page that the browser opens."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--remote-debugging-port=0"]
        words += [f"--user-data-dir={profile}", file.as_uri()]
        nothing = subprocess.DEVNULL
        with subprocess.Popen([browser, *words], stdout=nothing, stderr=nothing) as running:
            try:
                return sent.get(timeout=120.0)
            except queue.Empty:
                raise AssertionError(f"{file}: the page has drawn nothing") from None
            finally:
                running.terminate()


@pytest.mark.parametrize("frame", ["", "srcdoc", "src"])
def test_a_fit_is_drawn_in_a_browser(
    frame: str,
    browser: str,
    answers: "tuple[str, queue.Queue[Any]]",
    small: skinfit.Scene,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = small.fit(engine="cpu")
    page = found.page(tmp_path / "skin.html", title="Mine & yours")
    address, sent = answers
    text = page.file.read_text(encoding="utf-8")
    assert text.count("</body>") == 1
    page.file.write_text(text.replace("</body>", PROBE.replace("ADDRESS", address)), encoding="utf-8")
    file = page.file
    if frame:
        # By its address where it lies below the working folder.
        monkeypatch.chdir(tmp_path if frame == "src" else Path(__file__).parent)
        file = tmp_path / "notebook.html"
        html = page._repr_html_()
        assert html.startswith(f"<iframe {frame}=")
        file.write_text(f"<!doctype html><title>A notebook</title>{html}", encoding="utf-8")
    told = opened(browser, file, sent)
    assert told["title"].startswith("Mine & yours") and (told["width"], told["height"]) == (48, 40)
    # It stands where the fit has ended: the targets are the model's own.
    assert told["psnr"] > 60.0
    assert told["sliders"]["rim_exponent"] == pytest.approx(found.params["rim_exponent"], abs=1e-3)
