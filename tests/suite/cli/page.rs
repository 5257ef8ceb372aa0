//! The page in a real browser: headless Chromium opens it from the disk, with WebGPU, without, and without any graphics
//! adapter; what one does there is done by the names of its controls.
//!
//! Screenshots go to target/screenshots, to be looked at.

mod several;
mod visit;

use std::io::Read as _;
use std::path::Path;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};
use skinfit::render::files::Image;
use skinfit::render::tonemap::ToneMap;
use skinfit::report::pictures::BACKGROUND;
use visit::{With, visit};

use super::browser::browser;
use super::sandbox::Sandbox;
use crate::fixtures::read_exr;

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
    let sandbox = Sandbox::with_shared_bakes();
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
    let sandbox = Sandbox::with_shared_bakes();
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
    let sandbox = Sandbox::with_shared_bakes();
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
