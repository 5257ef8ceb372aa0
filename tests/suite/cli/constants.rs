//! Constants that are given: by a file that was fitted with other effects, and on the command line.

use serde_json::Value;

use super::sandbox::Sandbox;
use crate::fixtures::read_exr;

/// The scene without the rim, as `plain.toml`, fitted into `plain`.
fn fitted_without_rim() -> Sandbox {
    let sandbox = Sandbox::new();
    let text = sandbox.text("scene.toml").replace("\"rim\", ", "").replace("\"rim_weight\", ", "");
    sandbox.write("plain.toml", text.as_bytes());
    sandbox.run(&["fit", "plain.toml", "-o", "plain"]).done();
    sandbox
}

#[test]
fn what_was_not_fitted_is_named_where_it_is_drawn() {
    let sandbox = fitted_without_rim();
    let render = |more: &[&str]| {
        let to = ["--params", "plain/params.toml", "--engine", "cpu", "-o", "a.exr"];
        let ran = sandbox.run(&[&["render"], more, &to].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        ran.err
    };
    let warned = render(&["scene.toml"]);
    for words in [
        "warning: plain/params.toml: was fitted with the effects diffuse, normal_map, occlusion, side_specular,",
        "but scene.toml has diffuse, normal_map, occlusion, rim, side_specular",
        "drawn is the latter's, with rim_weight = 0.5, which was not fitted.",
        "--effects diffuse,normal_map,occlusion,side_specular,hilite,reflection.",
    ] {
        assert!(warned.contains(words), "{words}: {warned}");
    }
    // As the warning says to: nothing is left to warn of, and it is the fit's own picture.
    let effects = ["scene.toml", "--effects", "diffuse,normal_map,occlusion,side_specular,hilite,reflection"];
    assert_eq!(render(&effects), "");
    let fewer = read_exr(&sandbox.path("a.exr")).rgb(["R", "G", "B"]);
    assert_eq!(render(&["plain.toml"]), "");
    assert!(read_exr(&sandbox.path("a.exr")).rgb(["R", "G", "B"]) == fewer);
    // Whoever names effects means what is left out; more of them are worth a word.
    assert_eq!(render(&["scene.toml", "--effects", "diffuse,hilite"]), "");
    assert!(render(&["plain.toml", "--effects", "diffuse,rim"]).contains("but --effects has diffuse, rim."));
    // What was chosen is no default that slipped in.
    let chosen = render(&["scene.toml", "--set", "rim_weight=0.9"]);
    assert!(chosen.contains("but scene.toml has") && !chosen.contains("rim_weight"), "{chosen}");
    let shader = sandbox.run(&["shader", "scene.toml", "--params", "plain/params.toml", "--show", "plan"]);
    assert!(shader.err.contains("with rim_weight = 0.5, which was not fitted"), "{shader:?}");
    let study = ["tradeoff", "scene.toml", "--params", "plain/params.toml", "--axis", "filter", "-o", "cost"];
    let study = sandbox.run(&study);
    assert!(study.err.contains("with rim_weight = 0.5, which was not fitted"), "{study:?}");
}

#[test]
fn a_value_on_the_command_line_is_drawn() {
    let sandbox = Sandbox::new();
    let draw = |to: &str, more: &[&str]| {
        sandbox.run(&[&["render", "scene.toml", "--engine", "cpu", "-o", to], more].concat()).done();
        read_exr(&sandbox.path(to)).rgb(["R", "G", "B"])
    };
    sandbox.write("p.toml", b"[params]\nhilite = [0.7, 0.6, 0.5]\nspecular_lobe = 20\n");
    let set = ["--set", "hilite=0.7,0.6,0.5", "--set", "specular_lobe=20"];
    let file = draw("file.exr", &["--params", "p.toml"]);
    assert!(file == draw("set.exr", &set));
    // Over the file's, where both are given.
    let both = draw("both.exr", &["--params", "p.toml", "--set", "hilite=0.7"]);
    assert!(both != file && both == draw("c.exr", &["--set", "specular_lobe=20"]));
    let refused = |value: &str, words: &str| {
        let ran = sandbox.run(&["render", "scene.toml", "-o", "d.exr", "--set", value]);
        assert!(ran.code == Some(2) && ran.err.contains(words), "{ran:?}");
    };
    refused("hilit=1", "unknown parameter `hilit`. Did you mean `hilite`?");
    refused("hilite=1,2", "hilite takes one number, or three");
    refused("occlusion=2", "occlusion = 2 is out of bounds. Give a finite number in [0, 1]");
    assert!(!sandbox.path("d.exr").exists());
}

#[test]
fn a_fit_starts_from_values_on_the_command_line_and_remembers_them() {
    let sandbox = Sandbox::new();
    sandbox.edit("\"rim_exponent\", ", "");
    let set = ["--set", "rim_exponent=3", "--set", "hilite=0.4,0.5,0.6"];
    sandbox.fit("run", &set).done();
    let report = sandbox.json("run/report.json");
    let hilite = &report["params"]["hilite"];
    // Three values are fitted in each channel, from there; what is not free stays.
    assert_eq!(hilite["start"], serde_json::json!([0.4, 0.5, 0.6]));
    for value in hilite["value"].as_array().unwrap() {
        // The truth, with the exponent that it has: as near as in other fits of it.
        assert!((value.as_f64().unwrap() - 0.5).abs() < 1e-4 * 0.5, "{hilite}");
    }
    assert!(report["params"].get("rim_exponent").is_none());
    assert_eq!(report["provenance"]["set"], Value::from("rim_exponent=3, hilite=0.4,0.5,0.6"));
    assert!(sandbox.text("run/report.html").contains("rim_exponent=3, hilite=0.4,0.5,0.6"));
    let params = sandbox.text("run/params.toml");
    assert!(params.contains("# Set on the command line before the fit: rim_exponent=3, hilite=0.4,0.5,0.6."));
    assert!(params.contains("\nrim_exponent = 3.0\n"), "{params}");
    // So the same fit can be made again from the run folder alone, to the bit.
    sandbox.run(&["fit", "run/scene.toml", "-o", "again"]).done();
    let values = |text: &str| {
        text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(values(&params), values(&sandbox.text("again/params.toml")));
    // A fit from elsewhere is another one.
    sandbox.fit("half", &[&set[..], &["--max-iterations", "1"]].concat());
    sandbox.fit("half", &["--resume"]).refused(&["half/state.json: this state belongs to another fit"]);
}
