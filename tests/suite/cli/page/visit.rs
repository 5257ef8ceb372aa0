//! A browser without a window that opens a page from the disk, and a script in it.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::Value;

use crate::cli::browser::browser;

/// How long a page is waited for: the software adapter of a browser takes seconds to compile a shader.
const PATIENCE: Duration = Duration::from_secs(900);

/// What a browser draws with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum With {
    /// WebGPU, on a program on the CPU.
    WebGpu,
    /// WebGPU's interface, and no adapter.
    NoAdapter,
    /// Neither WebGPU nor WebGL.
    Nothing,
}

impl With {
    const fn flags(self) -> &'static [&'static str] {
        match self {
            Self::WebGpu => &[
                "--enable-unsafe-webgpu",
                "--use-webgpu-adapter=swiftshader",
                "--enable-features=Vulkan",
                "--use-vulkan=swiftshader",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
            ],
            Self::NoAdapter => &[],
            Self::Nothing => &["--disable-gpu"],
        }
    }
}

/// A browser that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What a script that is run in a page returns; `shot` is what the page looks like then. The page holds an image that the
/// test serves once the script has ended: it is loaded then and not before.
pub(super) fn visit(page: &Path, with: With, script: &str, shot: Option<&str>) -> Option<Value> {
    let browser = browser()?;
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}", server.local_addr().unwrap());
    let answers = serve(server);
    let html = std::fs::read_to_string(page).unwrap();
    let probe = format!(
        "<img src=\"{address}/hold\" alt=\"\" style=\"position: absolute\"><script>{HANDS}\n\
         (async () => {{ let found; try {{ found = await (async () => {{ {script} }})(); }} \
         catch (error) {{ found = {{ error: String(error?.stack ?? error), told: skinfit.told() }}; }} \
         await fetch('{address}/found', {{ method: 'POST', mode: 'no-cors', body: JSON.stringify(found) }}); }})();\
         </script></body>"
    );
    let probed = page.with_extension("probed.html");
    std::fs::write(&probed, html.replacen("</body>", &probe, 1)).unwrap();
    let profile = tempfile::tempdir().unwrap();
    let shot = shot.map(|name| {
        let folder = Path::new(env!("CARGO_BIN_EXE_skinfit")).ancestors().nth(2).unwrap().join("screenshots");
        std::fs::create_dir_all(&folder).unwrap();
        folder.join(name)
    });
    let mut command = Command::new(browser);
    command
        .args(["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars"])
        .args(["--force-color-profile=srgb", "--window-size=1400,1100"])
        .args(with.flags())
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(shot.as_ref().map_or("--dump-dom".to_owned(), |file| format!("--screenshot={}", file.display())))
        .arg(format!("file://{}", probed.display()))
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut running = Running(command.spawn().unwrap());
    let found = answers.recv_timeout(PATIENCE);
    let found: Value = serde_json::from_slice(&found.expect("the page does not answer")).unwrap();
    assert!(found.get("error").is_none(), "{with:?}: {found}");
    if let Some(file) = shot {
        running.0.wait().unwrap();
        let image = image::open(&file).unwrap().to_rgb8();
        let colours = image.pixels().map(|pixel| pixel.0).collect::<std::collections::BTreeSet<_>>().len();
        // A page with images has thousands of colours; an empty one has a few.
        assert!(colours > 1000, "{}: {colours} colours", file.display());
    }
    Some(found)
}

/// Keep what is held until something was found, which is sent.
fn serve(server: TcpListener) -> Receiver<Vec<u8>> {
    let (send, answers) = channel();
    std::thread::spawn(move || {
        let mut held = Vec::new();
        for stream in server.incoming() {
            let Ok(mut stream) = stream else { return };
            let Some((path, body)) = request(&stream) else { continue };
            if path != "/found" {
                held.push(stream);
                continue;
            }
            let answer = b"HTTP/1.1 204 No Content\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";
            let _ = stream.write_all(answer);
            // The test may be over.
            let _ = send.send(body);
            for mut stream in held.drain(..) {
                let _ = stream
                    .write_all(b"HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\nconnection: close\r\n\r\n");
            }
        }
    });
    answers
}

/// A request's path and body.
fn request(stream: &TcpStream) -> Option<(String, Vec<u8>)> {
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let path = line.split(' ').nth(1)?.to_owned();
    let mut length = 0;
    loop {
        let mut header = String::new();
        reader.read_line(&mut header).ok()?;
        if header.trim().is_empty() {
            break;
        }
        let (name, value) = header.split_once(':')?;
        if name.eq_ignore_ascii_case("content-length") {
            length = value.trim().parse().ok()?;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    Some((path, body))
}

/// What scripts use the page with: controls by their names, as assistive technology has them.
const HANDS: &str = r##"
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const until = async (what, done) => {
  const since = performance.now();
  while (!done()) {
    if (performance.now() - since > 600000) throw new Error(`${what}: waited too long`);
    await pause(10);
  }
};
const control = (name) => {
  const named = [...document.querySelectorAll("[aria-label]")].filter((node) => node.getAttribute("aria-label") === name);
  const worded = [...document.querySelectorAll("button")].filter((node) => !node.hasAttribute("aria-label") && node.textContent === name);
  const found = [...named, ...worded];
  if (found.length !== 1) throw new Error(`${found.length} controls are called ${name}`);
  return found[0];
};
const press = (name) => {
  const found = control(name);
  if (found.disabled) throw new Error(`${name} cannot be pressed`);
  found.click();
};
const slide = (name, places) => {
  const slider = control(name);
  for (const place of places) {
    slider.value = place;
    slider.dispatchEvent(new Event("input"));
  }
  slider.dispatchEvent(new Event("change"));
};
const complete = () => until("the page is complete", () => {
  const state = skinfit.state();
  return state?.image && state.idle && state.image.psnr !== null && skinfit.pixels("now") && skinfit.pixels("error");
});
const bytes = (name) => {
  const image = skinfit.pixels(name);
  let text = "";
  for (let i = 0; i < image.bytes.length; i += 8192) text += String.fromCharCode(...image.bytes.subarray(i, i + 8192));
  return { width: image.width, height: image.height, bytes: btoa(text) };
};
// What the probe says of the middle of the first pane, which is pointed at.
const probe = async () => {
  const canvas = document.querySelector("#panes canvas");
  const box = canvas.getBoundingClientRect();
  const at = { clientX: box.left + box.width / 2, clientY: box.top + box.height / 2, pointerId: 1, bubbles: true };
  canvas.dispatchEvent(new PointerEvent("pointermove", at));
  await until("the probe", () => document.querySelectorAll("#probe-rows tr").length > 4);
  return [...document.querySelectorAll("#probe-rows tr")].map((row) => [...row.children].map((cell) => cell.textContent));
};
const key = (name, more = {}) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, ...more }));
const value = (name) => skinfit.state().rows.flatMap((row) => row.sliders).find((slider) => slider.name === name).value;
"##;
