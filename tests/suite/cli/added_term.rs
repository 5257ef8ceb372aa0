//! A scene that brings a term of its own: every command that a user would meet it in.

use super::refusals::{Case, FIT, check};
use super::sandbox::{Sandbox, TRUTH};
use crate::added_maps::FRECKLES;
use crate::added_term::FRESNEL;
use crate::fixtures::read_exr;

const EFFECTS: &str = "\"hilite\", \"reflection\"]";

/// A scene with the term; its targets show it.
fn scene() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("terms/fresnel.wgsl", FRESNEL.as_bytes());
    let with = "\"hilite\", \"reflection\", \"fresnel_reflection\"]\nterms = [\"terms/fresnel.wgsl\"]";
    sandbox.edit(EFFECTS, with);
    sandbox.edit("hilite = 0.7", "hilite = 0.7\nfresnel_weight = 0.3");
    sandbox.edit(
        "\"specular_lobe\"]",
        "\"fresnel_weight\", \"fresnel_f0\"]\nper_channel = [\"fresnel_weight\"]",
    );
    sandbox
}

#[test]
fn its_parameters_are_listed_and_its_rules_are_in_the_shader_of_its_scene() {
    let sandbox = scene();
    let listed = sandbox.run(&["params", "scene.toml"]).done().out;
    assert!(
        listed.contains("fresnel_f0") && listed.contains("[0, 0.2]") && listed.contains("Schlick 1994"),
        "{listed}"
    );
    assert!(!sandbox.run(&["params"]).done().out.contains("fresnel_f0"));
    let shader = sandbox.run(&["shader", "scene.toml"]).done().out;
    assert!(shader.contains("fresnel_part") && shader.contains("fn schlick("), "{shader}");
    // An option may name its effect, and leave it out.
    let only = sandbox.run(&["shader", "scene.toml", "--effects", "diffuse,fresnel_reflection"]).done().out;
    assert!(only.contains("fn schlick(") && !only.contains("hilite_faces"));
    let without = sandbox.run(&["shader", "scene.toml", "--effects", "diffuse"]).done().out;
    assert!(!without.contains("fn schlick("));
}

#[test]
fn its_maps_are_found_from_the_folder_of_a_run() {
    let sandbox = Sandbox::new();
    sandbox.write("terms/freckles.wgsl", FRECKLES.as_bytes());
    sandbox.edit(EFFECTS, "\"hilite\", \"reflection\", \"freckles\"]\nterms = [\"terms/freckles.wgsl\"]");
    sandbox.edit("[environment]", "[maps.own]\nfreckle = \"specular.png\"\n[environment]");
    sandbox.edit("\"specular_lobe\"]", "\"freckle_weight\"]");
    sandbox.write("truth.toml", TRUTH.replace("[params]", "[params]\nfreckle_weight = 0.4").as_bytes());
    let render = |scene: &str, params: &str, view: &str, out: &str| {
        let of = ["render", scene, "--params", params, "--view", view, "--engine", "cpu"];
        sandbox.run(&[&of[..], &["-o", out]].concat()).done();
    };
    for view in ["front", "side"] {
        render("scene.toml", "truth.toml", view, &format!("targets/{view}.exr"));
    }
    sandbox.run(&["fit", "scene.toml", "-o", "run", "--engine", "cpu"]).done();
    let own = sandbox.path("specular.png").display().to_string();
    assert!(sandbox.text("run/scene.toml").contains(&format!("freckle = \"{own}\"")));
    // Elsewhere than the scene that was fitted, the run's shows the same.
    render("scene.toml", "run/params.toml", "front", "here.exr");
    render("run/scene.toml", "run/params.toml", "front", "there.exr");
    let [here, there] = ["here.exr", "there.exr"].map(|name| read_exr(&sandbox.path(name)).planes);
    assert!(here == there, "the run's scene shows something else");
    // A fit of other maps is another fit.
    sandbox.edit("freckle = \"specular.png\"", "freckle = \"attenuator.png\"");
    let resumed = sandbox.run(&["fit", "scene.toml", "-o", "run", "--engine", "cpu", "--resume"]);
    assert!(resumed.code == Some(2) && resumed.err.contains("map freckle"), "{resumed:?}");
}

#[test]
fn without_a_list_of_effects_a_named_term_is_on() {
    let sandbox = scene();
    let text = sandbox.text("scene.toml");
    let list = text.lines().find(|line| line.starts_with("effects = ")).unwrap();
    sandbox.edit(list, "");
    assert!(sandbox.run(&["shader", "scene.toml"]).done().out.contains("fn schlick("));
}

#[test]
fn it_is_fitted_reported_drawn_and_exported() {
    if !super::graphics::adapter(&scene()) {
        return;
    }
    let sandbox = with_targets("gpu");
    for (engine, run) in [("cpu", "run_cpu"), ("gpu", "run")] {
        let fitted = sandbox.run(&["fit", "scene.toml", "-o", run, "--engine", engine]);
        assert_eq!(fitted.code, Some(0), "{fitted:?}");
        let report = sandbox.json(&format!("{run}/report.json"));
        let value = &report["params"]["fresnel_weight"]["value"];
        for (c, want) in [0.9, 0.7, 0.5].into_iter().enumerate() {
            // The targets' samples are rasterised and the fit's are traced; at the outline they differ.
            assert!((value[c].as_f64().unwrap() - want).abs() < 0.05, "{engine}: {value}");
        }
    }
    let file = sandbox.text("run/params.toml");
    assert!(file.contains("fresnel_weight = [") && file.contains("fresnel_f0 = "), "{file}");
    // The run's scene finds the term from where it lies.
    let terms = read_exr(&sandbox.path("run/front_terms.exr"));
    assert!(
        terms.planes.keys().any(|name| name.starts_with("fresnel_reflection")),
        "{:?}",
        terms.planes.keys()
    );
    let glsl = sandbox.run(&["export", "run/params.toml", "--to", "glsl"]).done().out;
    assert!(glsl.contains("float skinfit_schlick(") && glsl.contains("FRESNEL_WEIGHT"), "{glsl}");
    let c = sandbox.run(&["export", "run/params.toml", "--to", "c"]).done().out;
    assert!(c.contains("skinfit_fresnel_weight[3]"), "{c}");
    let layers = [
        "render",
        "run/scene.toml",
        "--params",
        "run/params.toml",
        "--layers",
        "--engine",
        "gpu",
        "-o",
        "a.exr",
    ];
    sandbox.run(&layers).done();
    let layers = read_exr(&sandbox.path("a.exr"));
    assert!(
        layers.planes.keys().any(|name| name.starts_with("fresnel_reflection")),
        "{:?}",
        layers.planes.keys()
    );
}

/// The truth that targets are drawn with, and where they are drawn.
fn with_targets(engine: &str) -> Sandbox {
    let sandbox = scene();
    let truth =
        "form = \"corrected\"\n[params]\nfresnel_weight = [0.9, 0.7, 0.5]\nfresnel_f0 = 0.1\nhilite = 0.6\n";
    sandbox.write("more.toml", truth.as_bytes());
    for view in ["front", "side"] {
        let target = format!("targets/{view}.exr");
        let of = ["render", "scene.toml", "--params", "more.toml", "--view", view];
        sandbox.run(&[&of[..], &["--engine", engine, "-o", &target]].concat()).done();
    }
    sandbox
}

#[test]
fn the_processor_draws_it_with_its_layer_fits_it_and_verifies_the_fit() {
    let sandbox = with_targets("cpu");
    let fitted = sandbox.run(&["fit", "scene.toml", "-o", "run", "--engine", "cpu", "--verify"]);
    assert_eq!(fitted.code, Some(0), "{fitted:?}");
    assert!(fitted.err.contains("verified against the model in f64"), "{fitted:?}");
    let report = sandbox.json("run/report.json");
    let params = &report["params"];
    for (c, want) in [0.9, 0.7, 0.5].into_iter().enumerate() {
        let value = &params["fresnel_weight"]["value"];
        // Targets and fit share their samples; 32-bit roundings of a target are what is left, and directions in which
        // two parameters trade lend them a thousand times their weight.
        assert!((value[c].as_f64().unwrap() - want).abs() < 1e-3, "{value}");
    }
    let of = ["render", "run/scene.toml", "--params", "run/params.toml", "--engine", "cpu"];
    sandbox.run(&[&of[..], &["--layers", "-o", "a.exr"]].concat()).done();
    for file in ["a.exr", "run/front_terms.exr"] {
        let planes = read_exr(&sandbox.path(file)).planes;
        assert!(
            planes.keys().any(|name| name.starts_with("fresnel_reflection")),
            "{file}: {:?}",
            planes.keys()
        );
    }
}

#[test]
fn an_ablation_tells_what_it_is_worth() {
    let sandbox = with_targets("cpu");
    sandbox.run(&["ablate", "scene.toml", "--params", "more.toml", "-o", "parts"]).done();
    let listed = std::fs::read_dir(sandbox.path("parts")).unwrap().flatten();
    let texts = listed.filter_map(|entry| std::fs::read_to_string(entry.path()).ok());
    assert!(texts.filter(|text| text.contains("fresnel_reflection")).count() > 0);
}

#[cfg(feature = "burn")]
#[test]
fn a_map_is_fitted_beside_it() {
    let sandbox = with_targets("cpu");
    if !super::graphics::adapter(&sandbox) {
        return;
    }
    sandbox.edit("color = \"color.png\"\n", "");
    sandbox.edit("loss = ", "maps = { rounds = 1, steps = 4, color = { smoothness = 0.0 } }\nloss = ");
    let fitted = sandbox.fit("run", &["--maps", "color"]);
    assert_eq!(fitted.code, Some(0), "{fitted:?}");
    let report = sandbox.json("run/maps.json");
    let psnr = |when: &str| report["views"][0][when]["psnr"].as_f64().unwrap();
    // The map is what the targets were drawn with and the scene lacks.
    assert!(psnr("after") > psnr("before"), "{report}");
}

#[test]
fn terms_that_cannot_be_used_are_refused_with_their_file_and_line() {
    fn spoil(sandbox: &Sandbox, change: fn(&Sandbox)) {
        sandbox.write("terms/fresnel.wgsl", FRESNEL.as_bytes());
        sandbox.edit(EFFECTS, "\"reflection\", \"fresnel_reflection\"]\nterms = [\"terms/fresnel.wgsl\"]");
        change(sandbox);
    }
    fn change(sandbox: &Sandbox, old: &str, new: &str) {
        assert!(FRESNEL.contains(old), "{old}");
        sandbox.write("terms/fresnel.wgsl", FRESNEL.replacen(old, new, 1).as_bytes());
    }
    check(&[
        Case {
            what: "no file",
            arguments: FIT,
            spoil: &|sandbox| spoil(sandbox, |sandbox| sandbox.remove("terms/fresnel.wgsl")),
            words: &["terms/fresnel.wgsl: there is no such file", "relative to that file"],
        },
        Case {
            what: "no WGSL",
            arguments: FIT,
            spoil: &|sandbox| spoil(sandbox, |sandbox| change(sandbox, "min(abs(", "mini(abs(")),
            words: &["terms/fresnel.wgsl: line 12: it is no valid WGSL", "Correct the function"],
        },
        Case {
            what: "a quantity that nothing gives",
            arguments: FIT,
            spoil: &|sandbox| {
                spoil(sandbox, |sandbox| change(sandbox, "mirror_light: vec4f", "miror_light: vec4f"));
            },
            words: &["terms/fresnel.wgsl: line 22: nothing gives miror_light. Did you mean mirror_light"],
        },
        Case {
            what: "a name that is taken",
            arguments: FIT,
            spoil: &|sandbox| {
                spoil(sandbox, |sandbox| change(sandbox, "parameter: fresnel_f0", "parameter: hilite"));
            },
            words: &["terms/fresnel.wgsl: line 5: the parameter or quantity `hilite` is there already"],
        },
        Case {
            what: "a parameter out of its bounds",
            arguments: FIT,
            spoil: &|sandbox| spoil(sandbox, |sandbox| sandbox.edit("hilite = 0.7", "fresnel_f0 = 0.7")),
            words: &["scene.toml: line 17: fresnel_f0 = 0.7 is out of bounds", "[0, 0.2]"],
        },
    ]);
}

/// What other scenes do not know of the file's own term they pass over; a name that no term has stays a mistake.
#[test]
fn its_constants_can_be_used_where_nobody_knows_the_term() {
    let sandbox = scene();
    let fitted = sandbox.run(&["fit", "scene.toml", "-o", "run", "--engine", "cpu"]);
    assert!(matches!(fitted.code, Some(0 | 1)), "{fitted:?}");
    let params = sandbox.text("run/params.toml");
    assert!(
        params.contains("terms = [\"fresnel_reflection\", \"fresnel_weight\", \"fresnel_f0\"]"),
        "{params}"
    );
    let elsewhere = Sandbox::new();
    elsewhere.write("found.toml", params.as_bytes());
    let header = elsewhere.run(&["export", "found.toml", "--to", "c"]).done().out;
    assert!(header.contains("rim_weight") && !header.contains("fresnel"), "{header}");
    let render = ["render", "scene.toml", "--view", "front", "--engine", "cpu", "-o", "front.exr"];
    elsewhere.run(&[&render[..], &["--params", "found.toml"]].concat()).done();
    elsewhere.write("found.toml", params.replace("fresnel_f0 =", "fresnel_f1 =").as_bytes());
    elsewhere.run(&["export", "found.toml", "--to", "c"]).refused(&["unknown parameter `fresnel_f1`"]);
}
