//! `shader` and `export`: what they print and write, and what they refuse.

use skinfit::export::Target;

use super::refusals::{Case, check};
use super::sandbox::Sandbox;

#[test]
fn a_scenes_shader_and_its_plan_are_printed_and_written() {
    let sandbox = Sandbox::new();
    let all = sandbox.run(&["shader", "scene.toml"]).done().out;
    assert!(all.contains("left out:") && all.contains("fn fs_main(") && all.contains("fn vs_main("));
    let plan = sandbox.run(&["shader", "scene.toml", "--show", "plan"]).done().out;
    assert!(plan.starts_with(|c: char| c.is_ascii_digit()) && !plan.contains("fs_main"), "{plan}");
    sandbox.run(&["shader", "scene.toml", "--show", "wgsl", "-o", "skin.wgsl"]).done();
    naga::front::wgsl::parse_str(&sandbox.text("skin.wgsl")).unwrap();
    // The hilite's cube is read by no other effect.
    let less = sandbox.run(&["shader", "scene.toml", "--effects", "diffuse,rim"]).done().out;
    assert!(all.contains("var hilite_faces") && !less.contains("var hilite_faces"));
}

#[test]
fn a_fits_constants_are_exported_with_their_provenance() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let value = sandbox.json("run/report.json")["params"]["rim_weight"]["value"].clone();
    for target in Target::ALL {
        let name = target.name();
        let whole = sandbox.run(&["export", "run/params.toml", "--to", name, "--constants"]).done().out;
        assert!(whole.contains("run/params.toml") && whole.contains("scene.toml"), "{whole}");
        assert!(whole.to_lowercase().contains("rim_weight"), "{whole}");
        if target.dialect().is_some() {
            let file = format!("skin.{name}");
            sandbox.run(&["export", "run/params.toml", "--to", name, "-o", &file]).done();
            let text = sandbox.text(&file);
            assert!(text.contains("skinfit_shade") && text.contains("Standard error of"), "{text}");
        }
    }
    // Data holds nothing but constants.
    let json = sandbox.run(&["export", "run/params.toml", "--to", "json"]).done().out;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let exported = &json["constants"]["rim_weight"];
    let red = |value: &serde_json::Value| value.as_f64().or_else(|| value[0].as_f64());
    assert_eq!(red(exported), red(&value), "{exported} {value}");
}

#[test]
fn constants_for_another_scenes_effects_are_exported_with_a_word_of_it() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    sandbox.write(
        "other.toml",
        sandbox.text("scene.toml").replace("\"hilite\", \"reflection\"", "\"hilite\"").as_bytes(),
    );
    let export = |scene: &str| sandbox.run(&["export", "run/params.toml", "--to", "c", "--scene", scene]);
    assert_eq!(export("scene.toml").done().err, "");
    let ran = export("other.toml");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for words in ["run/params.toml: was fitted with the effects", "but other.toml has", "--scene"] {
        assert!(ran.err.contains(words), "{ran:?}");
    }
}

#[test]
fn exports_that_cannot_be() {
    let nothing = |_: &Sandbox| {};
    let alone =
        |sandbox: &Sandbox| sandbox.write("p/params.toml", b"form = \"corrected\"\n[params]\nhilite = 0.5\n");
    let listing =
        |sandbox: &Sandbox| sandbox.write("p.toml", b"form = \"listing\"\n[params]\nhilite = 0.5\n");
    let case = |what, arguments, spoil, words| Case { what, arguments, spoil, words };
    check(&[
        case(
            "missing parameters",
            &["export", "p.toml", "--to", "glsl"],
            &nothing,
            &["p.toml", "cannot be read"],
        ),
        case(
            "no scene beside",
            &["export", "p/params.toml", "--to", "glsl"],
            &alone,
            &["p/params.toml", "--scene"],
        ),
        case(
            "another form",
            &["export", "p.toml", "--scene", "scene.toml", "--to", "glsl"],
            &listing,
            &["p.toml, line 1", "form `listing`"],
        ),
    ]);
}

#[test]
fn words_that_are_no_target_and_no_accuracy_are_refused_with_those_that_are() {
    let sandbox = Sandbox::new();
    let ran = sandbox.run(&["export", "p.toml", "--to", "glls"]);
    assert!(ran.code == Some(2) && ran.err.contains("Did you mean `glsl`?"), "{ran:?}");
    let ran = sandbox.run(&["shader", "scene.toml", "--accuracy", "high"]);
    assert!(ran.code == Some(2) && ran.err.contains("exact") && ran.err.contains("paper"), "{ran:?}");
}
