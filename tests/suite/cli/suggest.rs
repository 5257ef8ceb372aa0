//! `skinfit suggest`: it finds what made the targets, says what that costs, and leaves a scene that can be fitted.

use super::lit;
use super::sandbox::{Ran, Sandbox};

/// The scene, whose targets every effect of its list has had a part in.
fn suggested(more: &[&str]) -> (Sandbox, Ran) {
    let sandbox = Sandbox::new();
    let ran = sandbox.run(&[&["suggest", "scene.toml", "-o", "which", "--gpu", "never"][..], more].concat());
    (sandbox, ran)
}

#[test]
fn what_made_the_targets_is_found_and_fitted() {
    let (sandbox, ran) = suggested(&[]);
    let ran = ran.done();
    let results = sandbox.json("which/results.json");
    let names = |value: &serde_json::Value| -> Vec<String> {
        value.as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect()
    };
    let chosen = names(&results["suggested"]);
    for effect in ["diffuse", "normal_map", "occlusion", "rim"] {
        assert!(chosen.iter().any(|name| name == effect), "{effect}: {chosen:?}\n{}", ran.out);
    }
    // Each step on the way up is worth the gain required.
    let sets = results["sets"].as_array().unwrap();
    let score = |place: usize| sets[place]["held_out"].as_f64().unwrap();
    let steps = results["steps"].as_array().unwrap();
    let place = |step: &serde_json::Value| step["set"].as_u64().unwrap() as usize;
    assert!(steps.len() > 3 && steps[0]["what"] == "start", "{steps:?}");
    for pair in steps.windows(2) {
        let gain = score(place(&pair[1])) - score(place(&pair[0]));
        let removed = pair[1]["what"].as_str().unwrap().starts_with("without ");
        assert!(if removed { gain > -0.1 } else { gain >= 0.1 }, "{pair:?}");
    }
    // The targets are the model's own: what was found explains them.
    let end = score(place(&steps[steps.len() - 1]));
    assert!(end > score(0) + 10.0, "{end} {}", score(0));
    assert!(!chosen.iter().any(|name| name == "fresnel"), "{chosen:?}");
    // Of sets that are dearer and no better, none is on the front.
    let on_front: Vec<_> = sets.iter().filter(|set| set["front"] == true).collect();
    for set in &on_front {
        let of = |set: &serde_json::Value, key: &str| set[key].as_f64().unwrap();
        let beaten = sets.iter().any(|other| {
            of(other, "operations") < of(set, "operations") && of(other, "held_out") > of(set, "held_out")
        });
        assert!(!beaten, "{set}");
    }
    assert_eq!(sandbox.text("which/results.csv").lines().count(), 1 + sets.len());
    assert!(sandbox.text("which/front.svg").starts_with("<svg"));
    assert!(ran.out.contains("suggested: diffuse") && ran.out.contains("held out, dB"), "{}", ran.out);
    // The scene that it leaves has those effects, and fits.
    let scene = sandbox.text("which/scene.toml");
    assert!(scene.contains("# a comment") && scene.contains("effects = [\"diffuse\""), "{scene}");
    let fitted = sandbox.run(&["fit", "which/scene.toml", "-o", "run", "--engine", "cpu"]);
    assert_eq!(fitted.code, Some(0), "{fitted:?}");
}

#[test]
fn lamps_are_found_where_targets_show_them() {
    let sandbox = lit::scene("\"light.key.color\"");
    let ran = sandbox.run(&["suggest", "scene.toml", "-o", "which", "--gpu", "never"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let results = sandbox.json("which/results.json");
    let chosen = results["suggested"].as_array().unwrap();
    // Shadows are worth less than the least gain here; a path tracer's gloss is nowhere in the targets.
    assert!(chosen.iter().any(|name| name == "lights"), "{chosen:?}\n{}", ran.out);
    assert!(!chosen.iter().any(|name| name == "fresnel"), "{chosen:?}\n{}", ran.out);
    // Sets without them are what is asked for.
    assert!(!format!("{}{}", ran.out, ran.err).contains("do not shine"), "{ran:?}");
    // The scene that it leaves has the lamps, and fits.
    let scene = sandbox.text("which/scene.toml");
    assert!(scene.contains("name = \"key\"") && scene.contains("\"lights\""), "{scene}");
    let fitted = sandbox.run(&["fit", "which/scene.toml", "-o", "run", "--engine", "cpu"]);
    assert_eq!(fitted.code, Some(0), "{fitted:?}");
}

#[test]
fn nothing_is_worth_more_than_there_is() {
    let (sandbox, ran) = suggested(&["--least", "200"]);
    ran.done();
    assert_eq!(sandbox.json("which/results.json")["suggested"], serde_json::json!(["diffuse"]));
}

#[test]
fn one_view_is_too_few_and_a_folder_of_another_command_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.edit("target = \"targets/side.exr\"\n", "");
    let suggest = ["suggest", "scene.toml", "-o", "which", "--gpu", "never"];
    sandbox.run(&suggest).refused(&["scene.toml", "has 1 views with targets", "Give it two or more"]);
    sandbox.fit("run", &["--engine", "cpu"]);
    let there = ["suggest", "scene.toml", "-o", "run", "--gpu", "never"];
    sandbox.run(&there).refused(&["holds results of skinfit fit"]);
}
