//! The page in a real browser: headless Chromium opens it from the disk, with WebGPU, without, and without any graphics
//! adapter; what one does there is done by the names of its controls.
//!
//! Screenshots go to target/screenshots, to be looked at.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};
use skinfit::render::files::Image;
use skinfit::render::tonemap::ToneMap;
use skinfit::report::pictures::BACKGROUND;

use super::browser::browser;
use super::sandbox::Sandbox;
use crate::fixtures::read_exr;

/// How long a page is waited for: the software adapter of a browser takes seconds to compile a shader.
const PATIENCE: Duration = Duration::from_secs(900);

/// What a browser draws with.
#[derive(Clone, Copy, Debug, PartialEq)]
enum With {
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
fn visit(page: &Path, with: With, script: &str, shot: Option<&str>) -> Option<Value> {
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

/// How a page shows an image that the program has rendered.
fn expected(file: &Path) -> Vec<[u8; 3]> {
    let mut planes = read_exr(file);
    let (rgb, alpha) = (planes.rgb(["R", "G", "B"]), planes.planes.remove("A").unwrap());
    let image = Image { width: planes.width, height: planes.height, rgb, alpha };
    image.encoded(ToneMap::default(), BACKGROUND).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
}

/// That a pane shows an image, and how many of its pixels differ by more than a level: an adapter rounds
/// otherwise, and takes another of two triangles that meet in a sample.
fn same(pane: &Value, file: &Path, most: usize) {
    let bytes = BASE64_STANDARD.decode(pane["bytes"].as_str().unwrap()).unwrap();
    let want = expected(file);
    assert_eq!(bytes.len(), 4 * want.len());
    let off = |(got, want): (&[u8], &[u8; 3])| (0..3).any(|c| got[c].abs_diff(want[c]) > 1);
    let count = bytes.chunks_exact(4).zip(&want).filter(|(got, want)| off((got, want))).count();
    assert!(count <= most, "{}: {count} of {} pixels differ", file.display(), want.len());
}

/// The built-in scene as a page, as a run of its fit, and as images at its start.
fn made(sandbox: &Sandbox) {
    let said = sandbox.run(&["page", "-o", "page.html"]).done().out;
    assert!(said.contains("page.html (") && said.contains("MiB"), "{said}");
    sandbox.run(&["render", "--engine", "cpu", "--view", "front", "-o", "front.exr"]).done();
}

#[test]
fn a_page_draws_with_webgpu_and_fits_as_the_program_does() {
    if browser().is_none() {
        return;
    }
    let sandbox = Sandbox::new();
    made(&sandbox);
    sandbox.run(&["fit", "-o", "run", "--engine", "cpu"]).done();
    let page = sandbox.path("page.html");
    let script = r##"
        await complete();
        const found = { engine: skinfit.state().engine, told: skinfit.told(), start: bytes("now"), target: bytes("target"),
          status: document.getElementById("status").textContent };
        const before = value("base_weight");
        const psnr = skinfit.state().image.psnr;
        slide("base_weight", [0.3, 0.5, 0.6]);
        await until("the image follows", () => value("base_weight") !== before && skinfit.state().can_undo && skinfit.state().idle && skinfit.state().image.psnr !== psnr);
        found.moved = [before, value("base_weight")];
        // A drag is one step.
        press("undo");
        await until("it is undone", () => !skinfit.state().can_undo);
        found.undone = value("base_weight");
        // A fixed parameter stays where it is.
        press("fit hilite");
        await until("it is fixed", () => !skinfit.state().rows.find((row) => row.name === "hilite").free);
        const hilite = () => skinfit.state().rows.find((row) => row.name === "hilite").sliders.map((slider) => slider.value);
        const fixed = hilite();
        press("fit");
        await until("it fits", () => skinfit.state().fitting);
        await until("the fit ends", () => skinfit.state().found && !skinfit.state().fitting);
        found.fixed = [fixed, hilite()];
        // The fit is one step back, and so is what was fixed.
        press("undo");
        press("undo");
        await until("all is as it was", () => !skinfit.state().can_undo);
        press("fit");
        await until("it fits", () => skinfit.state().fitting);
        await until("the fit ends", () => skinfit.state().found && !skinfit.state().fitting);
        await complete();
        found.ending = skinfit.state().found;
        found.constants = await skinfit.constants();
        found.scores = skinfit.state().scores;
        found.losses = skinfit.state().losses;
        found.psnr = skinfit.state().image.psnr;
        found.errors = skinfit.state().rows.flatMap((row) => row.sliders).filter((slider) => slider.error).length;
        found.probe = (await probe()).map(([name]) => name);
        found.tables = [...document.querySelectorAll("#rows th")].map((head) => head.textContent);
        return found;
    "##;
    let Some(found) = visit(&page, With::WebGpu, script, Some("page.png")) else { return };
    let engine = found["engine"].as_str().unwrap();
    assert!(engine.starts_with("gpu"), "{engine}: {found}");
    // The CPU engine's image: the adapter's edges take other samples.
    same(&found["start"], &sandbox.path("front.exr"), 320 * 320 / 200);
    assert_eq!(found["told"], json!([]));
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let [before, after] = numbers(&found["moved"])[..] else { panic!("{}", found["moved"]) };
    assert!((after - before).abs() > 0.05 && found["undone"].as_f64() == Some(before), "{}", found["moved"]);
    assert_eq!(found["fixed"][0], found["fixed"][1], "it was fixed");

    // The constants are the program's: the same objective and the same solver, but for the order in which vectors of
    // another width are summed, which is far below what the images determine.
    let report = sandbox.json("run/report.json");
    let unknowns = report["unknowns"].as_array().unwrap();
    let constants = found["constants"].as_array().unwrap();
    assert_eq!(unknowns.len(), constants.len());
    for unknown in unknowns {
        let name = unknown["name"].as_str().unwrap();
        let constant =
            constants.iter().find(|constant| constant[0] == name).unwrap_or_else(|| panic!("{name}"));
        let (got, want) = (constant[1].as_f64().unwrap(), unknown["value"].as_f64().unwrap());
        assert!((got - want).abs() <= 1e-4 * want.abs().max(0.1), "{name}: {got} for {want}");
    }
    assert!(found["ending"].as_str().unwrap().starts_with("converged"), "{}", found["ending"]);
    for score in found["scores"].as_array().unwrap() {
        let native = &report["views"][score["view"].as_str().unwrap()]["psnr"];
        let (got, want) = (score["psnr"].as_f64().unwrap(), native.as_f64().unwrap());
        // Of targets that the scene's own constants made nearly all is roundings.
        assert!(got > 60.0 && (got - want).abs() < 6.0, "{score}: {want}");
    }
    assert_eq!(found["losses"].as_array().unwrap().len(), report["history"].as_array().unwrap().len());
    assert!(found["errors"].as_u64().unwrap() as usize >= constants.len(), "{}", found["errors"]);
    let rows: Vec<&str> = found["probe"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    for name in ["pixel", "position", "normal", "target", "now", "residual", "FLIP"] {
        assert!(rows.contains(&name), "{name}: {rows:?}");
    }
    let names = found["tables"].as_array().unwrap();
    assert!(names.contains(&json!("base_weight")) && names.contains(&json!("specular_lobe")), "{names:?}");
}

#[test]
fn a_page_draws_without_webgpu_and_says_so() {
    if browser().is_none() {
        return;
    }
    let sandbox = Sandbox::new();
    made(&sandbox);
    let page = sandbox.path("page.html");
    for (with, words, shot) in
        [(With::NoAdapter, "WebGPU", "page_no_adapter.png"), (With::Nothing, "WebGPU", "page_nothing.png")]
    {
        let script = r##"
            await complete();
            const found = { engine: skinfit.state().engine, start: bytes("now"), status: document.getElementById("status").textContent };
            found.probe = await probe();
            const before = skinfit.state().image.psnr;
            slide("base_weight", [0.35]);
            await until("the image follows", () => skinfit.state().can_undo && skinfit.state().idle && skinfit.state().image.psnr !== before);
            found.psnr = [before, skinfit.state().image.psnr];
            // An effect that is switched off takes its parameters with it, and asks for other bakes.
            control("effect reflection").click();
            await until("it is off", () => !skinfit.state().rows.some((row) => row.name === "reflection"));
            await until("it is weighed", () => skinfit.state().effects.find((effect) => effect.name === "reflection").change);
            found.change = skinfit.state().effects.find((effect) => effect.name === "reflection").change;
            // The scene's own weights ask for morph targets: they come back, and nothing hangs.
            const drawn = skinfit.drawn();
            control("effect morph").click();
            await until("it was read anew", () => skinfit.drawn() > drawn);
            await complete();
            found.morph = skinfit.state().effects.find((effect) => effect.name === "morph").on;
            return found;
        "##;
        let Some(found) = visit(&page, with, script, Some(shot)) else { return };
        assert_eq!(found["engine"], "cpu", "{with:?}: {}", found["status"]);
        let status = found["status"].as_str().unwrap();
        assert!(status.contains("The CPU engine draws") && status.contains(words), "{with:?}: {status}");
        // The same engine on other vectors: a rounding to bytes may fall the other way.
        same(&found["start"], &sandbox.path("front.exr"), 0);
        assert_ne!(found["psnr"][0], found["psnr"][1]);
        assert!(found["change"].as_str().unwrap().contains("dB"), "{}", found["change"]);
        assert_eq!(found["morph"], true);
        // The probe's numbers are the image's.
        let row = |name: &str| -> Vec<f64> {
            let rows = found["probe"].as_array().unwrap();
            let row = rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("{name}: {rows:?}"));
            row[1].as_str().unwrap().split([' ', ',']).filter_map(|word| word.parse().ok()).collect()
        };
        let (place, now) = (row("pixel"), row("now"));
        let planes = read_exr(&sandbox.path("front.exr"));
        let rgb = planes.rgb(["R", "G", "B"])[place[1] as usize * planes.width + place[0] as usize];
        // As many digits as it writes.
        assert!(rgb.iter().zip(&now).all(|(&a, b)| (f64::from(a) - b).abs() < 6e-6), "{rgb:?} {now:?}");
    }
}

#[test]
fn a_run_is_a_page_that_its_report_links_to() {
    if browser().is_none() {
        return;
    }
    let sandbox = Sandbox::new();
    sandbox.fit("run", &["--engine", "cpu"]).done();
    sandbox.run(&["page", "run"]).done();
    let report = sandbox.text("run/report.html");
    assert!(report.contains("<a href=\"page.html\">"), "no link in the report");
    let page = sandbox.path("run/page.html");
    // It says nothing of where it was made.
    let place = sandbox.path("").display().to_string();
    let place = place.trim_end_matches('/').as_bytes();
    let held = |bytes: &[u8]| bytes.windows(place.len()).any(|window| window == place);
    assert!(held(&sandbox.read("run/scene.toml")), "what the page takes along says it");
    assert!(!held(&sandbox.read("run/page.html")) && !held(&scene_of(&sandbox.text("run/page.html"))));
    let script = r#"
        await complete();
        return { found: skinfit.state().found, scores: skinfit.state().scores, losses: skinfit.state().losses,
          constants: await skinfit.constants(), told: skinfit.told(),
          errors: skinfit.state().rows.flatMap((row) => row.sliders).filter((slider) => slider.error).length };
    "#;
    let Some(found) = visit(&page, With::NoAdapter, script, None) else { return };
    let report = sandbox.json("run/report.json");
    assert_eq!(found["told"], json!([]));
    for unknown in report["unknowns"].as_array().unwrap() {
        let constants = found["constants"].as_array().unwrap();
        let constant = constants.iter().find(|constant| constant[0] == unknown["name"]).unwrap();
        // As params.toml writes it.
        let (got, want) = (constant[1].as_f64().unwrap(), unknown["value"].as_f64().unwrap());
        assert!((got - want).abs() <= 1e-12 * want.abs(), "{}: {got} for {want}", unknown["name"]);
    }
    assert_eq!(found["losses"].as_array().unwrap().len(), report["history"].as_array().unwrap().len());
    assert_eq!(found["scores"].as_array().unwrap().len(), 2);
    assert!(found["found"].as_str().unwrap().starts_with(report["ending"].as_str().unwrap()));
}

/// The files of a page, in one piece.
fn scene_of(page: &str) -> Vec<u8> {
    let packed = page.split_once("id=\"scene\">").unwrap().1.split_once('<').unwrap().0;
    let packed = BASE64_STANDARD.decode(packed).unwrap();
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_fit_in_a_page_waits_ends_goes_on_and_leaves_views_out() {
    if browser().is_none() {
        return;
    }
    let sandbox = Sandbox::new();
    made(&sandbox);
    let script = r##"
        await complete();
        const found = {};
        // Another view, with an error that takes both images.
        key("e");
        await until("the error is signed", () => skinfit.state().look.error === "Signed");
        press("view profile");
        await until("the view", () => skinfit.state().view === 2);
        await complete();
        key("v");
        await until("the first view", () => skinfit.state().view === 0);
        press("fit view profile");
        await until("it is left out", () => !skinfit.state().views[2].fitted);
        press("fit");
        await until("it fits", () => skinfit.state().fitting);
        key("p");
        await until("it waits", () => skinfit.state().fitting.paused);
        await pause(300);
        const before = skinfit.state().losses.length;
        await pause(1500);
        found.waited = [before, skinfit.state().losses.length, control("go on").disabled];
        press("go on");
        await until("a step", () => skinfit.state().losses.length > 1 || !skinfit.state().fitting);
        if (skinfit.state().fitting) key("Escape");
        await until("it ends", () => !skinfit.state().fitting);
        found.stopped = skinfit.state().found;
        found.told = skinfit.told();
        if (skinfit.state().can_resume) {
          press("resume");
          await until("it goes on", () => skinfit.state().fitting);
        }
        await until("the fit ends", () => !skinfit.state().fitting && skinfit.state().found.startsWith("converged"));
        found.constants = await skinfit.constants();
        found.scores = skinfit.state().scores;
        return found;
    "##;
    let Some(found) = visit(&sandbox.path("page.html"), With::NoAdapter, script, None) else { return };
    assert_eq!(found["waited"][0], found["waited"][1], "it went on while it was to wait");
    assert_eq!(found["waited"][2], false);
    assert!(found["stopped"].is_string(), "{}", found["told"]);
    let held: Vec<bool> = found["scores"]
        .as_array()
        .unwrap()
        .iter()
        .map(|score| score["held_out"].as_bool().unwrap())
        .collect();
    assert_eq!(held, [false, false, true]);
    // As if nobody had stopped it, with that view left out.
    sandbox.run(&["fit", "-o", "held", "--engine", "cpu", "--hold-out", "profile"]).done();
    let report = sandbox.json("held/report.json");
    for unknown in report["unknowns"].as_array().unwrap() {
        let constants = found["constants"].as_array().unwrap();
        let constant = constants.iter().find(|constant| constant[0] == unknown["name"]).unwrap();
        let (got, want) = (constant[1].as_f64().unwrap(), unknown["value"].as_f64().unwrap());
        assert!((got - want).abs() <= 1e-4 * want.abs().max(0.1), "{}: {got} for {want}", unknown["name"]);
    }
}

#[test]
fn a_page_is_refused_in_words() {
    let sandbox = Sandbox::new();
    let missing = sandbox.run(&["page", "scene.toml", "--player", "none.html"]);
    assert_eq!(missing.code, Some(2));
    assert!(missing.err.contains("none.html") && missing.err.contains("src/page/build"), "{}", missing.err);
    sandbox.write("other.html", b"<html></html>");
    let other = sandbox.run(&["page", "scene.toml", "--player", "other.html"]);
    assert_eq!(other.code, Some(2));
    assert!(other.err.contains("other.html"), "{}", other.err);
}
