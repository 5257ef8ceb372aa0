//! `fit A B`: scenes of different light, fitted as one skin.

use serde_json::Value;

use super::graphics::adapter;
use super::runs::SHARE;
use super::sandbox::{SCENE, Sandbox};
use crate::fixtures::read_exr;

/// What the skin is made with in every scene.
const SKIN: &str = "base_weight = 0.8\nrim_weight = 0.9\nrim_exponent = 3.0\nside_specular = 0.4\nhilite = 0.5\n\
                    reflection = 0.1\nocclusion = 0.7\nspecular_lobe = 12.0\n";

/// The light that each scene is made with, and where the fit begins with it. The second one has a key light, too.
const LIGHTS: [(&str, [&str; 2]); 3] = [
    ("noon", ["environment_rotation = 20.0\n", "environment_rotation = 14.0\n"]),
    (
        "night",
        [
            "environment_rotation = -35.0\nkey_azimuth = 40.0\nkey_elevation = 30.0\nkey_color = 0.6\n",
            "environment_rotation = -30.0\nkey_azimuth = 36.0\nkey_elevation = 34.0\nkey_color = 1.0\n",
        ],
    ),
    // Its light is known, and nothing of it is free.
    ("dusk", ["environment_rotation = 75.0\n", "environment_rotation = 75.0\n"]),
];

/// A folder with three scenes of one skin, and with targets that the program renders of them.
pub(super) fn lit() -> Sandbox {
    let sandbox = Sandbox::new();
    for (name, [truth, start]) in LIGHTS {
        let scene = SCENE
            .replace("hilite = 0.7\n", &format!("hilite = 0.7\n{start}"))
            .replace("targets/", &format!("targets/{name}_"));
        let own = match name {
            "noon" => ", \"environment_rotation\"",
            "night" => ", \"environment_rotation\", \"key_azimuth\", \"key_elevation\", \"key_color\"",
            _ => "",
        };
        let scene = scene.replace(", \"specular_lobe\"]", &format!(", \"specular_lobe\"{own}]"));
        let key = if name == "night" { ", \"reflection\", \"key_light\"]" } else { ", \"reflection\"]" };
        // The first such list is that of the effects.
        let scene = scene.replacen(", \"reflection\"]", key, 1);
        sandbox.write(&format!("{name}.toml"), scene.as_bytes());
        sandbox.write("made.toml", format!("[params]\n{SKIN}{truth}").as_bytes());
        for view in ["front", "side"] {
            let (scene, target) = (format!("{name}.toml"), format!("targets/{name}_{view}.exr"));
            let render = ["render", &scene, "--engine", "cpu", "--params", "made.toml"];
            sandbox.run(&[&render[..], &["--view", view, "-o", &target]].concat()).done();
        }
    }
    sandbox
}

/// Each `name = number` of a text.
fn numbers(text: &str) -> Vec<(String, f64)> {
    let table: toml::Table = text.parse().unwrap();
    table.iter().map(|(name, value)| (name.clone(), value.as_float().unwrap())).collect()
}

#[test]
fn two_lights_find_one_skin_and_each_its_own_light() {
    let sandbox = lit();
    let fit = ["fit", "noon.toml", "night.toml", "dusk.toml", "--hold-out", "dusk", "-o", "run"];
    let ran = sandbox.run(&fit).done();
    let fitted: toml::Table = sandbox.text("run/params.toml").parse().unwrap();
    let report = sandbox.json("run/report.json");
    for (name, truth) in numbers(SKIN) {
        let found = fitted["params"][&name].as_float().unwrap();
        assert!((found - truth).abs() <= SHARE * truth, "{name}: {found} is not {truth}");
        assert_eq!(report["params"][&name]["value"].as_f64(), Some(found), "{name}");
    }
    assert!(fitted["params"].get("environment_rotation").is_none(), "it is no scene's alone: {fitted}");
    for (scene, [truth, _]) in LIGHTS {
        for (name, truth) in numbers(truth) {
            let found = fitted["scenes"][scene]["params"][&name].as_float().unwrap();
            // Angles are found to within a share of a radian.
            let most = if truth.abs() > 1.0 { SHARE * 1.0_f64.to_degrees() } else { SHARE };
            assert!((found - truth).abs() <= most, "{scene}: {name}: {found} is not {truth}");
            let told = &report["params"][format!("{scene}/{name}")]["value"];
            assert_eq!(told.as_f64(), (scene != "dusk").then_some(found), "{scene}: {name}");
        }
    }
    // A scene that was held out has what its own file says, and the skin that the others have found.
    for view in ["noon/front", "noon/side", "night/front", "night/side", "dusk/front", "dusk/side"] {
        let scores = &report["views"][view];
        assert!(scores["psnr"].as_f64().unwrap() > 80.0, "{view}: {scores}");
        assert_eq!(scores["held_out"].as_bool(), Some(view.starts_with("dusk")), "{view}");
        let stem = view.replace('/', "_");
        assert!(sandbox.path(&format!("run/{stem}.png")).exists(), "{stem}");
    }
    assert_eq!(report["scores"]["fitted"]["views"], 4);
    assert_eq!(report["scores"]["held_out"]["views"], 2);
    assert!(ran.out.lines().any(|line| line.trim().starts_with("night/key_azimuth")), "{}", ran.out);
    assert!(ran.out.contains("held out: dusk/front with a PSNR of "), "{}", ran.out);
    let page = sandbox.text("run/report.html");
    assert!(page.contains("<code>night/key_azimuth</code>") && page.contains("key light&#39;s direction"));
    // Names, errors and places go on as ever.
    let matrix = report["correlations"]["names"].as_array().unwrap();
    assert_eq!(matrix.len(), report["unknowns"].as_array().unwrap().len());
    assert!(matrix.contains(&Value::from("noon/environment_rotation")));
    assert!(!sandbox.path("run/scene.toml").exists());
    for scene in ["noon", "night", "dusk"] {
        assert!(sandbox.path(&format!("run/scenes/{scene}.toml")).exists(), "{scene}");
    }
}

#[test]
fn bounds_of_the_skin_hold_in_all_scenes_and_those_of_a_light_in_its_own() {
    let sandbox = lit();
    // The truth is a hilite of 0.5; of 20 and -35 degrees.
    let bounded = |scene: &str, to: &str, bounds: &str| {
        let text = sandbox.text(scene);
        sandbox.write(to, text.replace("[fit]\n", &format!("[fit]\nbounds = {{ {bounds} }}\n")).as_bytes());
    };
    let skin = "hilite = [0.1, 0.4]";
    bounded("noon.toml", "noon_within.toml", &format!("{skin}, environment_rotation = [-10.0, 16.0]"));
    bounded("night.toml", "night_within.toml", skin);
    sandbox.write("start.toml", b"[params]\nhilite = 0.3\n");
    let scenes = ["noon_within.toml", "night_within.toml"];
    let rest = ["--params", "start.toml", "-o", "run", "--engine", "cpu"];
    sandbox.run(&[&["fit"], &scenes[..], &rest].concat()).done();
    let params = sandbox.json("run/report.json")["params"].clone();
    let at = |name: &str| (params[name]["value"].as_f64().unwrap(), params[name]["at_bound"] == true);
    assert_eq!(at("hilite"), (0.4, true));
    assert_eq!(at("noon_within/environment_rotation"), (16.0, true));
    let (night, held) = at("night_within/environment_rotation");
    // What is wrong with the others moves it, but no bound of another scene's light holds it.
    assert!(!held && (night + 35.0).abs() < 5.0, "{night}");
    let kept: toml::Table = sandbox.text("run/scenes/noon_within.toml").parse().unwrap();
    assert_eq!(kept["fit"]["bounds"]["hilite"].as_array().unwrap()[1].as_float(), Some(0.4));
    // One skin has one interval.
    sandbox
        .run(&["fit", "noon_within.toml", "night.toml", "-o", "none"])
        .refused(&["its bounds of what is the skin's", "(the table's; there hilite in [0.1, 0.4])"]);
    // A start out of them is refused as one out of the table's is.
    let out = ["fit", "noon_within.toml", "night_within.toml", "-o", "none"];
    sandbox.run(&out).refused(&["the start value of hilite is 0.7, outside its bounds 0.1 to 0.4"]);
    assert!(!sandbox.path("none").exists());
}

#[test]
fn constants_of_a_joint_fit_are_used_with_one_scene() {
    let sandbox = lit();
    sandbox.run(&["fit", "noon.toml", "night.toml", "-o", "run"]).done();
    let fitted: toml::Table = sandbox.text("run/params.toml").parse().unwrap();
    let same = |scene: &str, other: &str| {
        let render = ["render", scene, "--engine", "cpu", "--params", "run/params.toml"];
        sandbox.run(&[&render[..], &["--view", "side", "-o", "again.exr"]].concat()).done();
        let (again, fitted) = (read_exr(&sandbox.path("again.exr")), read_exr(&sandbox.path(other)));
        for name in ["R", "G", "B", "A"] {
            for (again, fitted) in again.planes[name].iter().zip(&fitted.planes[name]) {
                // Only the cubes around the exponent are baked for a picture: a few roundings of f32.
                let off = (again - fitted).abs();
                assert!(off <= 1e-5 * (1.0 + fitted.abs()), "{scene} {name}: {again} is not {fitted}");
            }
        }
    };
    for name in ["noon", "night"] {
        same(&format!("{name}.toml"), &format!("run/{name}_side_terms.exr"));
        same(&format!("run/scenes/{name}.toml"), &format!("run/{name}_side_terms.exr"));
    }
    let export = ["export", "run/params.toml", "--constants", "--to", "json", "--scene", "night.toml"];
    let exported = sandbox.run(&export).done().out;
    let turn = fitted["scenes"]["night"]["params"]["environment_rotation"].as_float().unwrap();
    assert!(exported.contains(&format!("{turn:?}")), "{turn:?}: {exported}");
    // A third scene takes the skin, and keeps its own light.
    sandbox.run(&["fit", "dusk.toml", "-o", "dusk", "--params", "run/params.toml"]).done();
    let dusk: toml::Table = sandbox.text("dusk/params.toml").parse().unwrap();
    assert_eq!(dusk["params"]["environment_rotation"].as_float(), Some(75.0));
    assert!(sandbox.json("dusk/report.json")["loss"]["start"].as_f64().unwrap() < 1e-8);
    // The next joint fit starts where this one has ended.
    sandbox.run(&["fit", "noon.toml", "night.toml", "-o", "next", "--params", "run/params.toml"]).done();
    let loss = |run: &str, end: &str| sandbox.json(&format!("{run}/report.json"))["loss"][end].as_f64();
    assert!(loss("next", "start").unwrap() <= 1e-6 * loss("run", "start").unwrap());
}

#[test]
fn passes_on_an_adapter_are_of_all_scenes_too() {
    let sandbox = lit();
    if !adapter(&sandbox) {
        return;
    }
    let fit = ["fit", "noon.toml", "night.toml", "-o"];
    sandbox.run(&[&fit[..], &["gpu", "--engine", "gpu"]].concat()).done();
    let report = sandbox.json("gpu/report.json");
    assert_eq!(report["engine"], "gpu");
    for (name, truth) in numbers(SKIN) {
        let found = report["params"][&name]["value"].as_f64().unwrap();
        // Passes in f32 on another processor: as far off as roundings may be on this one, several times over.
        assert!((found - truth).abs() <= 10.0 * SHARE * truth, "{name}: {found} is not {truth}");
    }
    // The adapter's own samples are where a rasteriser finds them; nobody knows which are neighbours.
    let ran = sandbox.run(&[&fit[..], &["own", "--engine", "gpu", "--samples", "gpu"]].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = sandbox.json("own/report.json");
    let basis = report["errors"]["basis"].as_str().unwrap();
    assert!(["independent", "rounding"].contains(&basis), "{basis}");
    assert!(ran.out.contains("samples made by the GPU in "), "{}", ran.out);
}

#[test]
fn a_joint_fit_goes_on_to_the_same_end_on_any_number_of_threads() {
    let sandbox = lit();
    let fit = |run: &str, more: &[&str]| {
        sandbox.run(&[&["fit", "noon.toml", "night.toml", "-o", run, "--threads"], more].concat())
    };
    fit("whole", &["1"]).done();
    let ran = fit("run", &["2", "--max-iterations", "1"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    let other = |scenes: &[&str], what: &str| {
        let resume = [&["fit"], scenes, &["-o", "run", "--resume"]].concat();
        sandbox.run(&resume).refused(&["run/state.json", what]);
    };
    other(&["night.toml", "noon.toml"], "differs");
    other(&["noon.toml"], "differs");
    fit("run", &["2", "--resume"]).done();
    assert_eq!(sandbox.text("run/params.toml"), sandbox.text("whole/params.toml"));
    // Another run's scenes go with it.
    sandbox.run(&["fit", "noon.toml", "-o", "run"]).done();
    assert!(!sandbox.path("run/scenes").exists() && sandbox.path("run/scene.toml").exists());
    assert!(!sandbox.path("run/night_front.png").exists());
}

#[test]
fn scenes_that_are_no_one_skin_are_refused_and_leave_nothing() {
    let sandbox = lit();
    let with = |name: &str, from: &str, to: &str| {
        let text = sandbox.text("night.toml");
        assert!(text.contains(from), "{from}");
        sandbox.write(name, text.replacen(from, to, 1).as_bytes());
    };
    with("other_form.toml", "form = \"corrected\"", "form = \"listing\"");
    with("other_loss.toml", "relative_l2", "huber");
    with("other_effects.toml", "\"occlusion\", \"rim\"", "\"rim\"");
    with("other_free.toml", "\"base_weight\", ", "");
    with("other_colours.toml", "hilite = 0.7", "hilite = [0.7, 0.6, 0.5]");
    with("other_bumps.toml", "hilite = 0.7", "hilite = 0.7\nnormal_strength = 0.5");
    sandbox.write("a/noon.toml", b"");
    let before = sandbox.files();
    let refused = |scenes: &[&str], words: &[&str]| {
        sandbox.run(&[&["fit"], scenes, &["-o", "deep/run"]].concat()).refused(words);
    };
    let one = |other: &str, what: &str| {
        let words = [other, "cannot be fitted as one skin with noon.toml", what];
        refused(&["noon.toml", other], &words);
    };
    one("other_form.toml", "its form differs (listing; there corrected)");
    one("other_loss.toml", "its loss differs (huber; there relative_l2)");
    one("other_effects.toml", "its list of the skin's effects differs");
    one("other_free.toml", "its list of what is free of the skin differs");
    one("other_colours.toml", "hilite in each channel");
    one("other_bumps.toml", "its value of normal_strength differs (0.5; there 1)");
    refused(&["noon.toml", "night.toml", "./noon.toml"], &["./noon.toml: this scene is named twice"]);
    let held = ["noon.toml", "night.toml", "--hold-out", "nihgt"];
    refused(&held, &["no scene and no view `nihgt`", "Did you mean `night`?"]);
    refused(&["noon.toml", "night.toml", "--hold-out", "front", "--hold-out", "side"], &["nothing is left"]);
    refused(&["noon.toml", "--free", "hilite,hilite"], &["--free lists hilite twice"]);
    assert!(sandbox.files() == before, "files were left");
    let ran = sandbox.run(&["suggest", "noon.toml", "night.toml", "-o", "deep/run"]);
    let takers = "`fit`, `ablate`, `tradeoff` and `stability` alone take several";
    ran.refused(&["night.toml: this command takes one scene", takers]);
    for command in ["ablate", "tradeoff"] {
        let ran = sandbox.run(&[command, "noon.toml", "other_loss.toml", "-o", "deep/run"]);
        ran.refused(&["other_loss.toml: it cannot be fitted as one skin with noon.toml", "its loss differs"]);
    }
    assert!(sandbox.files() == before, "files were left");
    // What the command line says of all scenes makes them one.
    let fit = ["fit", "noon.toml", "other_loss.toml", "other_free.toml", "-o", "run", "--loss", "l2"];
    sandbox.run(&[&fit[..], &["--free", "base_weight,hilite", "--max-iterations", "3"]].concat());
    let unknowns = sandbox.json("run/report.json")["params"].clone();
    let names: Vec<&String> = unknowns.as_object().unwrap().keys().collect();
    assert_eq!(names, ["base_weight", "hilite"]);
    let scene: toml::Table = sandbox.text("run/scenes/other_free.toml").parse().unwrap();
    assert_eq!(scene["fit"]["free"].as_array().unwrap().len(), 2);
    assert_eq!(scene["fit"]["loss"].as_str(), Some("l2"));
}
