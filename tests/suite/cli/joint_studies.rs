//! Studies of several scenes: `ablate`, `tradeoff` and `stability` of one skin in different lights.

use serde_json::Value;

use super::damaged::sandbox_case;
use super::joint::lit;
use super::sandbox::{Sandbox, mesh};
use super::tradeoffs::done;

/// The scenes with three constants of the skin free and each light held beside its truth: a fit leaves a misfit, and takes
/// a moment.
fn misfit() -> Sandbox {
    let sandbox = lit();
    for name in ["noon.toml", "night.toml", "dusk.toml"] {
        let text = sandbox.text(name);
        let free = text.lines().find(|line| line.starts_with("free = ")).unwrap();
        let text = text.replace(free, "free = [\"base_weight\", \"rim_weight\", \"hilite\"]");
        sandbox.write(name, text.as_bytes());
    }
    sandbox
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

fn named<'a>(list: &'a Value, key: &str, name: &Value) -> &'a Value {
    list.as_array()
        .unwrap()
        .iter()
        .find(|item| item[key] == *name)
        .unwrap_or_else(|| panic!("{name}: {list}"))
}

/// The row of what is left out: `[]` or `["rim"]`.
fn row(results: &Value, left_out: &[&str]) -> Value {
    named(&results["rows"], "left_out", &Value::from(left_out)).clone()
}

#[test]
fn an_ablation_of_several_scenes_begins_with_their_joint_fit() {
    let sandbox = misfit();
    let scenes = ["noon.toml", "night.toml", "dusk.toml", "--hold-out", "dusk"];
    sandbox.run(&[&["fit", "-o", "run", "--engine", "cpu"], &scenes[..]].concat()).done();
    let ablate = ["ablate", "--gpu", "never", "-o"];
    let ran = sandbox.run(&[&ablate[..], &["parts"], &scenes].concat()).done();
    let (fit, results) = (sandbox.json("run/report.json"), sandbox.json("parts/results.json"));
    let whole = row(&results, &[]);
    let (loss, fitted) = (number(&whole["loss"]), number(&fit["loss"]["end"]));
    // Images are f64, passes f32: a loss is a mean of thousands of squares, each off by some 1e-7 of itself.
    assert!(fitted > 1e-6 && (loss - fitted).abs() <= 1e-5 * fitted, "{loss:e} is not {fitted:e}");
    for constant in whole["constants"].as_array().unwrap() {
        let found = &fit["params"][constant["name"].as_str().unwrap()];
        // The same fit, from the same start.
        assert_eq!(constant["value"], found["value"], "{constant}");
        assert_eq!(constant["std_error"], found["std_error"], "{constant}");
    }
    // Views that are fitted and those that are held out have the scores that the fit's report has.
    let views = |row: &Value| row["views"].as_array().unwrap().clone();
    let (seen, held) = (views(&whole), views(&whole["held_out"]));
    let names: Vec<&str> = seen.iter().chain(&held).map(|view| view["view"].as_str().unwrap()).collect();
    assert_eq!(names, ["noon/front", "noon/side", "night/front", "night/side", "dusk/front", "dusk/side"]);
    for view in seen.iter().chain(&held) {
        let scores = &fit["views"][view["view"].as_str().unwrap()];
        let (own, want) = (number(&view["psnr"]), number(&scores["psnr"]));
        // The report's pictures are made of the same numbers; its scores are told with fewer digits.
        assert!((own - want).abs() < 1e-2, "{view} {scores}");
    }
    assert_eq!(results["scenes"], Value::from(vec!["noon", "night", "dusk"]));
    assert!(sandbox.path("parts/noon_front_without_rim.png").exists());
    assert!(sandbox.path("parts/dusk_side_without_rim.png").exists());
    let page = sandbox.text("parts/report.html");
    assert!(
        page.contains("<h1>noon + night + dusk</h1>") && page.contains("of 3 scenes of one skin at once")
    );
    assert!(ran.out.lines().next().unwrap().contains("held out"), "{}", ran.out);
    // The key light is one scene's own: the others are as they were without it.
    let key = row(&results, &["key_light"]);
    for (own, whole) in views(&key).iter().zip(&seen) {
        let same = own["loss"] == whole["loss"];
        assert_eq!(same, !own["view"].as_str().unwrap().starts_with("night"), "{own}");
    }
    // The fit's constants say the same.
    let given = ["given", "--params", "run/params.toml"];
    sandbox.run(&[&ablate[..], &given, &scenes].concat()).done();
    let again = number(&row(&sandbox.json("given/results.json"), &[])["loss"]);
    // As they are written, the constants are those of the fit to the bit.
    assert!((again - loss).abs() <= 1e-9 * loss, "{again:e} is not {loss:e}");
}

#[test]
fn no_fit_of_an_ablation_sees_what_is_held_out() {
    let sandbox = misfit();
    let ablate = ["ablate", "noon.toml", "night.toml", "--gpu", "never", "--refit"];
    let run = |to: &str| {
        sandbox.run(&[&ablate[..], &["--hold-out", "night/side", "-o", to]].concat());
        sandbox.json(&format!("{to}/results.json"))["rows"].as_array().unwrap().clone()
    };
    let before = run("before");
    sandbox.write_grey("targets/night_side.exr", 32, 24);
    let after = run("after");
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        for key in ["left_out", "loss", "change", "views", "constants", "starts"] {
            assert_eq!(before[key], after[key], "{key}");
        }
        assert_ne!(before["held_out"]["loss"], after["held_out"]["loss"], "{}", before["left_out"]);
    }
    let refused = |names: &[&str], words: &[&str]| {
        sandbox
            .run(&[&["ablate", "noon.toml", "night.toml", "-o", "deep/run"], names].concat())
            .refused(words);
    };
    refused(&["--hold-out", "nihgt"], &["no scene and no view `nihgt`", "Did you mean `night`?"]);
    refused(
        &["--hold-out", "noon", "--hold-out", "night"],
        &["nothing is left to fit", "Leave one of them in"],
    );
    refused(&["./noon.toml"], &["this scene is named twice", "Name it once"]);
    assert!(!sandbox.path("deep").exists());
}

#[test]
fn a_tradeoff_of_several_scenes_is_of_all_their_views() {
    let sandbox = misfit();
    let axes = ["--axis", "irradiance", "--axis", "rays", "--axis", "silhouette"];
    let run = |scenes: &[&str], to: &str, more: &[&str]| {
        done(sandbox.run(&[&["tradeoff", "-o", to], scenes, &axes, more].concat()));
        sandbox.json(&format!("{to}/results.json"))
    };
    let both = ["noon.toml", "night.toml"];
    let [noon, night] = both.map(|scene| run(&[scene], scene.trim_end_matches(".toml"), &[]));
    let together = run(&both, "both", &["--within", "20%"]);
    assert!(noon.get("scenes").is_none() && together["scenes"] == Value::from(vec!["noon", "night"]));
    for axis in together["axes"].as_array().unwrap() {
        let of = |results: &Value| named(&results["axes"], "axis", &axis["axis"])["settings"].clone();
        assert!(axis["method"].as_str().unwrap().contains("Scenes: noon, night."), "{axis}");
        for setting in axis["settings"].as_array().unwrap() {
            let alone = [&noon, &night].map(|results| named(&of(results), "name", &setting["name"]).clone());
            let linear = |setting: &Value| number(&setting["error"]["linear"]);
            // Views of the same mesh and cameras cover as many pixels in either light: the pooled mean square is the mean.
            let want = (0.5 * alone.iter().map(|one| linear(one).powi(2)).sum::<f64>()).sqrt();
            // Sums of the same numbers in another order.
            assert!((linear(setting) - want).abs() <= 1e-9 * want, "{setting}");
            let flip = |setting: &Value| number(&setting["error"]["flip"]);
            let mean = 0.5 * (flip(&alone[0]) + flip(&alone[1]));
            assert!((flip(setting) - mean).abs() <= 1e-9, "{setting}");
            for (count, one) in
                setting["counts"].as_array().unwrap().iter().zip(alone[0]["counts"].as_array().unwrap())
            {
                assert_eq!(count, one, "the scenes have the same mesh and cubes");
            }
            assert_eq!(setting["present"], alone[0]["present"]);
        }
    }
    // The chosen settings are those of each scene.
    for scene in ["noon", "night"] {
        let table: toml::Table = sandbox.text(&format!("both/scenes/{scene}.toml")).parse().unwrap();
        let rays = table["quality"]["occlusion_rays"].as_integer().unwrap().to_string();
        let chosen = together["choice"]["settings"].as_array().unwrap();
        assert!(chosen.iter().any(|pair| pair[0] == "rays" && pair[1] == rays.as_str()), "{chosen:?} {rays}");
    }
    assert!(!sandbox.path("both/scene.toml").exists());
    run(&both, "both", &[]);
    assert!(!sandbox.path("both/scenes").exists(), "the settings of the run before are no longer true");
}

#[test]
fn no_fit_of_a_tradeoff_sees_what_is_held_out_and_what_makes_no_sense_is_refused() {
    let sandbox = misfit();
    let held = ["tradeoff", "noon.toml", "night.toml", "--hold-out", "night/side", "-o"];
    let run = |to: &str| {
        done(sandbox.run(&[&held[..], &[to, "--axis", "pixels"]].concat()));
        let results = sandbox.json(&format!("{to}/results.json"));
        assert_eq!(results["held_out"], Value::from(vec!["night/side"]));
        let settings = results["axes"][0]["settings"].as_array().unwrap().clone();
        settings
            .iter()
            .map(|s| (s["name"].clone(), s["error"].clone(), s["counts"].clone()))
            .collect::<Vec<_>>()
    };
    let before = run("before");
    sandbox.write_grey("targets/night_side.exr", 32, 24);
    assert_eq!(run("after"), before);
    assert!(sandbox.text("after/report.html").contains("No fit sees night/side; errors are of all views."));
    // Without it the other target would have changed the fits.
    done(sandbox.run(&["tradeoff", "noon.toml", "night.toml", "-o", "whole", "--axis", "pixels"]));
    let whole = sandbox.json("whole/results.json")["axes"][0]["settings"].clone();
    let last = |counts: &Value| counts.as_array().unwrap().last().unwrap()[1].clone();
    let all = whole.as_array().unwrap().last().unwrap();
    assert_ne!(last(&all["counts"]), last(&before.last().unwrap().2));
    sandbox.run(&[&held[..], &["deep/run", "--axis", "rays"]].concat()).refused(&[
        "of the axes to be swept (rays) none fits anything",
        "Sweep some of pixels, solver, too, or hold none out",
    ]);
    // Silhouettes are measured by how fine one mesh is.
    sandbox
        .write("other.glb", &mesh(|json, _| json["nodes"][0]["scale"] = serde_json::json!([0.9, 1.0, 1.0])));
    let other = sandbox.text("night.toml").replace("mesh.glb", "other.glb");
    sandbox.write("other.toml", other.as_bytes());
    let apart = ["tradeoff", "noon.toml", "other.toml", "-o", "deep/run", "--axis", "silhouette"];
    sandbox.run(&apart).refused(&[
        "the axis silhouette: ",
        "the scenes' meshes differ",
        "study the scenes one by one",
    ]);
    assert!(!sandbox.path("deep").exists());
}

#[test]
fn stability_tells_which_scene_a_case_is_of() {
    let sandbox = lit();
    let short = ["--no-gpu", "--cases", "100", "--pixels", "1000", "-o", "stable"];
    let study = |scenes: &[&str], more: &[&str]| {
        let ran = sandbox.run(&[&["stability"], scenes, &short, more].concat());
        (sandbox.json("stable/stability.json"), ran)
    };
    let both = ["noon.toml", "night.toml"];
    let (report, ran) = study(&both, &[]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.out.contains("\nsamples of noon ") && ran.out.contains("\nsamples of night "), "{ran:?}");
    assert!(!ran.out.contains("the scene's samples"), "{ran:?}");
    let (alone, ran) = study(&both[..1], &[]);
    assert!(ran.out.contains("\nthe scene's samples "), "{ran:?}");
    let engines = report["engines"].as_array().unwrap().iter().zip(alone["engines"].as_array().unwrap());
    for (engine, alone) in engines {
        let tried = |tally: &Value| tally["tried"].as_u64().unwrap();
        let [noon, night] = ["noon", "night"].map(|name| tried(&engine["scenes"][name]));
        assert!(noon > 1000 && night > 1000 && tried(&engine["scene"]) == noon + night, "{engine}");
        // What is of no scene is tried once, and each scene as if it were alone.
        assert!(alone.get("scenes").is_none() && engine["scenes"]["noon"] == alone["scene"], "{alone}");
        assert!(engine["cases"] == alone["cases"] && engine["random"] == alone["random"], "{alone}");
    }
    // A kept case in the light of a scene is tried in each; beyond what an f32 holds it fails in both.
    let case = sandbox_case([2e38; 3], 1000.0).replace("wavy", "scene");
    sandbox.write("cases.toml", case.as_bytes());
    let (_, ran) = study(&both, &["--replay", "cases.toml"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    for scene in ["noon", "night"] {
        let told = format!("kept: put there (in {scene}): CPU engine: red is inf");
        assert!(ran.err.contains(&told), "{told}: {ran:?}");
    }
    sandbox.run(&["stability", "noon.toml", "noon.toml"]).refused(&["this scene is named twice"]);
}
