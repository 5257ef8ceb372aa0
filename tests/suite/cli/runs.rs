//! What a fit leaves, and what can be done with it.

use serde_json::Value;
use skinfit::report::misfit::MOST;

use super::sandbox::{Sandbox, TRUTH};
use crate::fixtures::read_exr;

/// The fitted values are the truth within this share of it: half of the widest standard error that the roundings of f32
/// targets leave these small images, 2e-5 of the occlusion (5e-7 was found). Solvers for comparison stop where the loss
/// falls by less than 1e-12 of the first one: a millionth of what was off at first.
pub(super) const SHARE: f64 = 1e-5;

#[test]
fn a_fit_finds_the_truth_and_leaves_every_file_of_a_run() {
    let sandbox = Sandbox::new();
    let ran = sandbox.fit("runs/a", &[]).done();
    let report = sandbox.json("runs/a/report.json");
    let loss = report["loss"]["end"].as_f64().unwrap();
    let last = ran.out.lines().last().unwrap();
    assert_eq!(last, format!("runs/a: final loss {loss:.6e}"));
    assert_eq!(
        ran.out.lines().count(),
        8 + 4,
        "a line a parameter, how it ended, how good it is, on what, and where: {}",
        ran.out
    );

    let mut names: Vec<String> = std::fs::read_dir(sandbox.path("runs/a"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let pictures = ["front.png", "front_terms.exr", "side.png", "side_terms.exr"];
    let others = [".lock", "params.toml", "report.html", "report.json", "scene.toml", "state.json"];
    let mut expected = [&pictures[..], &others[..]].concat();
    expected.sort_unstable();
    assert_eq!(names, expected);
    check_report(&report);
    let line = "the model explains more than 99.9% of the targets' variance: a close match; no place is too bright or too dark \
                on average";
    assert!(ran.out.lines().any(|told| told == line), "{}", ran.out);
    check_origin(&report, "skinfit fit scene.toml -o runs/a");
    // Three images of 32 pixels, at least.
    let picture = image::open(sandbox.path("runs/a/front.png")).unwrap();
    assert!(picture.width() > 96 && picture.height() > 32, "{} x {}", picture.width(), picture.height());
    assert!(sandbox.text("runs/a/report.html").starts_with("<!DOCTYPE html>"));

    let fitted: toml::Table = sandbox.text("runs/a/params.toml").parse().unwrap();
    let truth: toml::Table = TRUTH.parse().unwrap();
    for (name, truth) in truth["params"].as_table().unwrap() {
        let (value, truth) = (fitted["params"][name].as_float().unwrap(), truth.as_float().unwrap());
        assert!((value - truth).abs() <= SHARE * truth, "{name}: {value} is not {truth}");
        assert_eq!(report["params"][name]["value"].as_f64(), Some(value), "{name}");
    }
}

/// Who made the report when, and on what.
fn check_origin(report: &Value, command: &str) {
    let told =
        |name: &str| report["provenance"][name].as_str().unwrap_or_else(|| panic!("{name}: {report:#}"));
    assert!(told("command").starts_with(command), "{}", told("command"));
    assert_eq!(told("software"), concat!("skinfit ", env!("CARGO_PKG_VERSION")));
    assert!(!told("processor").is_empty() && !told("instructions").is_empty());
    // 2026-11-23T01:02:03Z, and today's by another program's calendar, unless midnight has just passed.
    let now = std::process::Command::new("date").args(["-u", "+%F"]).output().unwrap();
    let (date, today) = (told("date"), String::from_utf8(now.stdout).unwrap());
    assert!(date.len() == 20 && date.ends_with('Z') && date.as_bytes()[10] == b'T', "{date}");
    assert!(date.starts_with(today.trim()) || date[11..] > *"23:5", "{date} is not {today}");
}

/// The keys of SCENE.md's `report.json`.
fn check_report(report: &Value) {
    let number = |place: &str| {
        let value = report.pointer(place).unwrap_or_else(|| panic!("{place} is missing: {report:#}"));
        value.as_f64().unwrap_or_else(|| panic!("{place} is {value}"))
    };
    assert!(number("/loss/end") < 1e-6 * number("/loss/start"), "{report:#}");
    for name in
        ["base_weight", "rim_weight", "rim_exponent", "side_specular", "hilite", "reflection", "occlusion"]
    {
        number(&format!("/params/{name}/start"));
        number(&format!("/params/{name}/value"));
        let [error, noise] = ["std_error", "noise_error"].map(|key| number(&format!("/params/{name}/{key}")));
        assert!(noise > 0.0 && error >= noise, "{name}: {error} {noise}");
        assert_eq!(report["params"][name]["identifiable"], Value::Bool(true), "{name}");
    }
    for view in ["front", "side"] {
        // Beyond 80 dB the images differ by less than 1 code in 10 000.
        assert!(number(&format!("/views/{view}/psnr")) > 80.0);
        assert!(number(&format!("/views/{view}/ssim")) > 0.9999);
        assert!(number(&format!("/views/{view}/flip")) < 1e-3);
    }
    assert_eq!((report["solver"].as_str(), report["engine"].as_str()), (Some("varpro"), Some("cpu")));
    // Of the CPU's samples it is known which are neighbours; the profile is of unknowns with great errors, here none.
    assert!(["blocks", "rounding"].contains(&report["errors"]["basis"].as_str().unwrap()), "{report:#}");
    assert!(number("/errors/most_over_noise") >= 1.0 && report["profile"].is_null(), "{report:#}");
    for count in ["iterations", "evaluations", "samples"] {
        assert!(report[count].as_u64().unwrap() > 0, "{count}");
    }
    for stage in ["load", "bake", "samples", "fit"] {
        assert!(number(&format!("/seconds/{stage}")) >= 0.0);
    }
    assert_eq!(report["warnings"], Value::Array(Vec::new()));
}

#[test]
fn a_fit_that_converged_and_is_wrong_says_where() {
    let sandbox = Sandbox::new();
    // The target is twice as bright as what the model may show: nothing but the rim is free.
    let text = sandbox.text("scene.toml");
    let free = text.lines().find(|line| line.starts_with("free = ")).unwrap();
    sandbox.edit(free, "free = [\"rim_weight\"]");
    let ran = sandbox.run(&["fit", "scene.toml", "-o", "run", "--set", "base_weight=0.3"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = sandbox.json("run/report.json");
    let misfit = &report["misfit"];
    assert_ne!(misfit["match"], "close", "{misfit:#}");
    let told: Vec<&Value> =
        misfit["places"].as_array().unwrap().iter().filter(|place| place["told"] == true).collect();
    assert!(!told.is_empty(), "{misfit:#}");
    for place in told.iter().take(MOST) {
        let side = if place["mean"].as_f64().unwrap() < 0.0 { "dark" } else { "bright" };
        let words = format!("  too {side} {} by ", place["place"].as_str().unwrap());
        assert!(ran.out.lines().any(|line| line.starts_with(&words)), "{words}: {}", ran.out);
        let page = sandbox.text("run/report.html");
        assert!(page.contains(&format!("<li>T{}", &words.trim()[1..])), "{words}");
    }
    // What the samples and cubes of this scene tell of its surface.
    let places: Vec<&str> =
        misfit["places"].as_array().unwrap().iter().map(|place| place["place"].as_str().unwrap()).collect();
    for place in ["overall", "where it faces the camera", "in view front", "in view side", "in red"] {
        assert!(places.contains(&place), "{place}: {places:?}");
    }
}

#[test]
fn with_json_the_report_is_all_that_is_printed() {
    let sandbox = Sandbox::new();
    let ran = sandbox.fit("run", &["--json"]).done();
    assert_eq!(ran.out, sandbox.text("run/report.json").trim_end().to_owned() + "\n");
    let report: Value = serde_json::from_str(&ran.out).unwrap();
    check_report(&report);
}

#[test]
fn the_run_folders_scene_and_parameters_render_the_fits_picture() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &["--max-iterations", "2"]);
    let rendered = sandbox.path("again.exr");
    let arguments = ["--params", "run/params.toml", "--view", "side", "-o", "again.exr"];
    // Under another name, so that every path must be absolute.
    std::fs::create_dir(sandbox.path("elsewhere")).unwrap();
    std::fs::copy(sandbox.path("run/scene.toml"), sandbox.path("elsewhere/s.toml")).unwrap();
    sandbox.run(&[&["render", "elsewhere/s.toml", "--engine", "cpu"], &arguments[..]].concat()).done();
    let (again, fitted) = (read_exr(&rendered), read_exr(&sandbox.path("run/side_terms.exr")));
    for name in ["R", "G", "B", "A"] {
        for (again, fitted) in again.planes[name].iter().zip(&fitted.planes[name]) {
            // Only the cubes around the exponent are baked for a picture: a few roundings of f32.
            assert!((again - fitted).abs() <= 1e-5 * (1.0 + fitted.abs()), "{name}: {again} is not {fitted}");
        }
    }
    assert!(sandbox.text("run/scene.toml").starts_with("# a comment\n"));
}

#[test]
fn a_fit_that_starts_at_the_answer_stays_there() {
    let sandbox = Sandbox::new();
    // Held at a wrong value, so that a loss is left and not rounding alone.
    sandbox.edit("\"rim_exponent\", ", "");
    sandbox.fit("a", &[]).done();
    sandbox.fit("b", &["--params", "a/params.toml"]).done();
    let (a, b) = (sandbox.json("a/report.json"), sandbox.json("b/report.json"));
    let loss = |report: &Value, end: &str| report["loss"][end].as_f64().unwrap();
    assert!(loss(&a, "end") > 1e-4 * loss(&a, "start"), "{a:#}");
    for end in ["start", "end"] {
        let (found, left) = (loss(&b, end), loss(&a, "end"));
        // The last step of a fit is taken unmeasured, on sums whose f32 products round by 6e-8 each.
        assert!((found - left).abs() <= 1e-6 * left, "{end}: {found} is not {left}");
    }
}

#[test]
fn the_loss_on_the_command_line_is_in_the_run_folders_scene() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &["--loss", "huber"]).done();
    let scene: toml::Table = sandbox.text("run/scene.toml").parse().unwrap();
    assert_eq!(scene["fit"]["loss"].as_str(), Some("huber"));
    assert_eq!(sandbox.json("run/report.json")["loss_name"], "huber");
    let first = sandbox.text("run/params.toml");
    sandbox.run(&["fit", "run/scene.toml", "-o", "again"]).done();
    let values = |text: &str| text.lines().skip(2).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(values(&first), values(&sandbox.text("again/params.toml")));
}

#[test]
fn parameters_with_three_values_are_fitted_in_each_channel() {
    let sandbox = Sandbox::new();
    sandbox.write("p.toml", b"[params]\nhilite = [0.4, 0.5, 0.6]\n");
    sandbox.fit("run", &["--params", "p.toml"]).done();
    let values = sandbox.json("run/report.json")["params"]["hilite"]["value"].clone();
    for value in values.as_array().unwrap() {
        assert!((value.as_f64().unwrap() - 0.5).abs() < SHARE * 0.5, "{values}");
    }
}

#[test]
fn every_solver_finds_the_truth_and_a_gain_that_is_not_one() {
    /// By what the side view is brighter than the front one.
    const GAIN: f64 = 1.3;
    let sandbox = Sandbox::new();
    sandbox.edit("[fit]", "[fit]\ngains = true");
    // Held at its true value: two weights and two powers are enough for solvers without derivatives.
    let text = sandbox.text("scene.toml");
    let free = text.lines().find(|line| line.starts_with("free = ")).unwrap();
    sandbox.edit(free, "free = [\"base_weight\", \"rim_weight\", \"rim_exponent\"]");
    sandbox.write("truth_bright.toml", format!("{TRUTH}[gains]\nside = {GAIN}\n").as_bytes());
    let render =
        ["render", "scene.toml", "--engine", "cpu", "--params", "truth_bright.toml", "--view", "side"];
    sandbox.run(&[&render[..], &["-o", "targets/side.exr"]].concat()).done();
    sandbox.write(
        "start.toml",
        TRUTH.replace("0.8", "1.0").replace("0.9", "0.5").replace("3.0", "2.0").as_bytes(),
    );
    let truth: toml::Table = TRUTH.parse().unwrap();
    for solver in ["varpro", "lm", "lbfgs", "nelder-mead", "adam"] {
        let ran = sandbox.fit(solver, &["--solver", solver, "--params", "start.toml"]);
        // Converged, and not stopped by the number of iterations.
        assert_eq!(ran.code, Some(0), "{solver}: {ran:?}");
        let report = sandbox.json(&format!("{solver}/report.json"));
        assert_eq!(report["solver"], solver);
        let fitted: toml::Table = sandbox.text(&format!("{solver}/params.toml")).parse().unwrap();
        let wanted =
            ["base_weight", "rim_weight", "rim_exponent"].map(|name| (name, &fitted["params"][name]));
        let wanted = wanted.map(|(name, found)| (name, found, truth["params"][name].as_float().unwrap()));
        for (name, found, want) in wanted.into_iter().chain([("gain", &fitted["gains"]["side"], GAIN)]) {
            let found = found.as_float().unwrap();
            let off = (found / want - 1.0).abs();
            println!("{solver}: {name} off by {off:.1e}");
            assert!(off <= SHARE, "{solver}: {name} = {found}, not {want}");
        }
    }
}

#[test]
fn a_views_white_balance_is_found_beside_the_skin() {
    let balance = [1.3, 1.0, 0.7];
    let sandbox = Sandbox::new();
    sandbox.write("truth_warm.toml", format!("{TRUTH}[gains]\nside = {balance:?}\n").as_bytes());
    let render = ["render", "scene.toml", "--engine", "cpu", "--params", "truth_warm.toml", "--view", "side"];
    sandbox.run(&[&render[..], &["-o", "targets/side.exr"]].concat()).done();
    sandbox.edit("[fit]", "[fit]\nwhite_balance = true");
    sandbox.fit("run", &[]).done();
    let fitted: toml::Table = sandbox.text("run/params.toml").parse().unwrap();
    let found = fitted["gains"]["side"].as_array().unwrap();
    for (found, want) in found.iter().zip(balance) {
        let found = found.as_float().unwrap();
        assert!((found / want - 1.0).abs() < SHARE, "{found} is not {want}");
    }
    assert_eq!(fitted["gains"]["front"].as_float(), Some(1.0));
    let report = sandbox.json("run/report.json");
    let names: Vec<&str> =
        report["unknowns"].as_array().unwrap().iter().map(|known| known["name"].as_str().unwrap()).collect();
    assert!(
        ["gain.side.r", "gain.side.g", "gain.side.b"].iter().all(|name| names.contains(name)),
        "{names:?}"
    );
    // Read back, they are where the next fit starts, and stay so where nothing frees them.
    sandbox.edit("white_balance = true", "white_balance = false");
    sandbox.fit("again", &["--params", "run/params.toml"]).done();
    let again: toml::Table = sandbox.text("again/params.toml").parse().unwrap();
    assert_eq!(again["gains"], fitted["gains"]);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let sandbox = Sandbox::new();
    let values = |threads: &str| {
        let run = format!("run{threads}");
        sandbox.fit(&run, &["--threads", threads, "--no-cache"]).done();
        let mut report = sandbox.json(&format!("{run}/report.json"));
        report["seconds"].take();
        for told in ["threads", "command", "date"] {
            report["provenance"][told].take();
        }
        for iteration in report["history"].as_array_mut().unwrap() {
            iteration["seconds"].take();
        }
        (report, sandbox.text(&format!("{run}/params.toml")), sandbox.read(&format!("{run}/front.png")))
    };
    assert!(values("1") == values("2"));
}

#[test]
fn pictures_of_views_that_are_gone_are_removed_and_nothing_else() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    // Not skinfit's, though they are called as if they were.
    sandbox.write("run/notes.png", b"mine");
    sandbox.write("run/mine_terms.exr", b"mine");
    sandbox.write("kept.png", b"mine");
    // A report that names what is not the folder's own is not believed.
    let mut report = sandbox.json("run/report.json");
    report["files"].as_array_mut().unwrap().push("../kept.png".into());
    sandbox.write("run/report.json", report.to_string().as_bytes());
    sandbox.edit("name = \"side\"", "name = \"left\"");
    sandbox.fit("run", &[]).done();
    for (name, there) in [
        ("run/side.png", false),
        ("run/side_terms.exr", false),
        ("run/left.png", true),
        ("run/left_terms.exr", true),
        ("run/front.png", true),
        ("run/notes.png", true),
        ("run/mine_terms.exr", true),
        ("kept.png", true),
    ] {
        assert_eq!(sandbox.path(name).exists(), there, "{name}");
    }
}

#[test]
fn the_start_values_on_the_command_line_are_in_the_run_folders_scene() {
    let sandbox = Sandbox::new();
    sandbox
        .write("p.toml", b"[params]\nrim_exponent = 3.5\nhilite = [0.4, 0.5, 0.6]\nnormal_strength = 0.9\n");
    sandbox.fit("run", &["--params", "p.toml"]).done();
    let scene: toml::Table = sandbox.text("run/scene.toml").parse().unwrap();
    let start = &scene["model"]["params"];
    assert_eq!(
        (start["rim_exponent"].as_float(), start["normal_strength"].as_float()),
        (Some(3.5), Some(0.9))
    );
    // So the same fit can be made again from the run folder alone, to the bit.
    sandbox.run(&["fit", "run/scene.toml", "-o", "again"]).done();
    let values = |text: &str| text.lines().skip(2).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(values(&sandbox.text("run/params.toml")), values(&sandbox.text("again/params.toml")));
}

#[test]
fn a_fit_of_nothing_says_that_nothing_was_free() {
    let sandbox = Sandbox::new();
    let text = sandbox.text("scene.toml");
    let free = text.lines().find(|line| line.starts_with("free = ")).unwrap();
    sandbox.edit(free, "free = []");
    let ran = sandbox.fit("run", &[]).done();
    // How it ended, how good it is and at most `MOST` places where it is wrong, on what, and where.
    assert!((4..=4 + MOST).contains(&ran.out.lines().count()), "{ran:?}");
    let page = sandbox.text("run/report.html");
    assert!(page.contains("Nothing was free: ") && page.contains("Nothing was free, so "));
    assert!(!page.contains("determine every") && !page.contains("Any change of the free parameters"));
}

/// Fit what a targets' `truth` says, with `effects` more, from the defaults; every value that it gives
/// must be found.
fn recovers(effects: &str, truth: &str) {
    let sandbox = Sandbox::new();
    sandbox.edit("\"reflection\"]", &format!("\"reflection\"{effects}]"));
    sandbox.write("truth.toml", truth.as_bytes());
    for view in ["front", "side"] {
        let path = format!("targets/{view}.exr");
        sandbox.run(&["render", "scene.toml", "--params", "truth.toml", "--view", view, "-o", &path]).done();
    }
    let truth: toml::Table = truth.parse().unwrap();
    let truth = truth["params"].as_table().unwrap();
    let quoted =
        |names: Vec<&String>| names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
    let free = quoted(truth.keys().collect());
    let coloured = quoted(truth.iter().filter(|(_, value)| value.is_array()).map(|(name, _)| name).collect());
    let text = sandbox.text("scene.toml");
    let line = text.lines().find(|line| line.starts_with("free = ")).unwrap();
    sandbox.edit(line, &format!("free = [{free}]\nper_channel = [{coloured}]"));
    sandbox.fit("run", &[]).done();
    let report = sandbox.json("run/report.json");
    for (name, truth) in truth {
        let found = &report["params"][name]["value"];
        for c in 0..3 {
            let channel = |value: &Value| value.get(c).unwrap_or(value).as_f64().unwrap();
            let truth = truth.get(c).unwrap_or(truth).as_float().unwrap();
            // What two constants explain nearly alike takes up more of the roundings (2e-5 was found of the occlusion).
            assert!(
                (channel(found) - truth).abs() <= 5.0 * SHARE * truth.abs(),
                "{name}: {found} is not {truth}"
            );
        }
    }
}

#[test]
fn a_turned_environment_is_found_together_with_the_occlusion() {
    recovers(
        "",
        "[params]\nenvironment_rotation = 14.0\nocclusion = 0.6\nbase_weight = 0.8\nrim_weight = 0.9\n",
    );
}

#[test]
fn a_key_lights_direction_and_colour_are_found() {
    recovers(
        ", \"key_light\"",
        "[params]\nkey_azimuth = 25.0\nkey_elevation = 30.0\nkey_color = [1.4, 1.1, 0.7]\nbase_weight = 0.8\n",
    );
}
