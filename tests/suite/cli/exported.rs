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
fn constants_alone_need_no_scene() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let there = sandbox.run(&["export", "run/params.toml", "--to", "c"]).done();
    // Away from its scene, and whatever has become of that.
    sandbox.write("away/params.toml", &sandbox.read("run/params.toml"));
    sandbox.remove("mesh.glb");
    for target in Target::ALL {
        let name = target.name();
        let ran = sandbox.run(&["export", "away/params.toml", "--to", name, "--constants"]).done();
        assert!(ran.out.to_lowercase().contains("rim_weight") && ran.err.is_empty(), "{ran:?}");
    }
    let away = sandbox.run(&["export", "away/params.toml", "--to", "c"]).done();
    let code = |text: &str| {
        text.lines().filter(|line| !line.starts_with("//")).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(code(&away.out), code(&there.out));
    assert!(!away.out.contains("Scene:"), "{}", away.out);
    // The shader does, and says what for.
    sandbox.run(&["export", "away/params.toml", "--to", "glsl"]).refused(&[
        "away/params.toml: no scene.toml lies beside it",
        "maps, silhouette",
        "--constants",
    ]);
}

#[test]
fn what_is_exported_as_toml_draws_the_same_picture() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    sandbox.run(&["export", "run/params.toml", "--to", "toml", "-o", "skin.toml"]).done();
    let draw = |params: &str, to: &str| {
        sandbox.run(&["render", "scene.toml", "--engine", "cpu", "--params", params, "-o", to]).done();
        crate::fixtures::read_exr(&sandbox.path(to)).rgb(["R", "G", "B"])
    };
    assert!(draw("run/params.toml", "a.exr") == draw("skin.toml", "b.exr"), "the pictures differ");
}

#[test]
fn values_on_the_command_line_are_exported_and_told() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let export = |more: &[&str]| sandbox.run(&[&["export", "run/params.toml", "--to"], more].concat());
    let header = export(&["c", "--set", "hilite=0.7,0.6,0.5", "--set", "occlusion=0.25"]).done().out;
    assert!(header.contains("// Set for this export: hilite=0.7,0.6,0.5, occlusion=0.25\n"), "{header}");
    assert!(header.contains("skinfit_hilite[3] = {0.7f, 0.6f, 0.5f};"), "{header}");
    assert!(header.contains("skinfit_occlusion = 0.25f;"), "{header}");
    let shader = export(&["glsl", "--set", "hilite=0"]).done().out;
    assert!(shader.contains("// Left out, as their weight is 0: hilite."), "{shader}");
    let ran = export(&["c", "--set", "key_azimuth=3"]);
    assert!(
        ran.code == Some(0) && ran.err.contains("--set key_azimuth=3: no enabled effect asks for it"),
        "{ran:?}"
    );
    let ran = export(&["c", "--set", "hilite=-1"]);
    assert!(ran.code == Some(2) && ran.err.contains("hilite = -1 is out of bounds"), "{ran:?}");
    export(&["c", "--set", "hilite=1", "--set", "hilite=2"]).refused(&["--set gives hilite twice"]);
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
    for words in [
        "run/params.toml: was fitted with the effects",
        "but other.toml has",
        "What is exported is the latter's",
        "--scene",
    ] {
        assert!(ran.err.contains(words), "{ran:?}");
    }
}

#[test]
fn a_material_includes_the_shader_by_its_name() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let material = |to: &str, shader: &str| {
        sandbox.run(&["export", "run/params.toml", "--to", to, "--material", shader])
    };
    let godot = material("godot", "skin.gdshaderinc").done().out;
    // The shader stands within a string of the material.
    assert!(
        godot.contains("#include \\\"skin.gdshaderinc\\\"") && godot.contains("ShaderMaterial"),
        "{godot}"
    );
    assert!(
        godot.contains("res://irradiance.dds") && godot.contains("at.vertex_occlusion = UV2.x;"),
        "{godot}"
    );
    let unity = material("unity", "Skin.hlsl").done().out;
    assert!(unity.contains("#include \"Skin.hlsl\"") && unity.contains("skinfit_hilite_cube (\""), "{unity}");
    // Unreal's holds it, but where it is told a path of a shader directory.
    let unreal = material("unreal", "Skin").done().out;
    assert!(unreal.starts_with("Begin Object ") && unreal.contains("Description=\"Skin\""), "{unreal}");
    assert!(unreal.contains("struct Skinfit {") && !unreal.contains("IncludeFilePaths"), "{unreal}");
    let unreal = material("unreal", "/Project/Skin.ush").done().out;
    assert!(unreal.contains("IncludeFilePaths(0)=\"/Project/Skin.ush\""), "{unreal}");
    assert!(!unreal.contains("struct Skinfit {"), "{unreal}");
    material("glsl", "skin.glsl").refused(&["glsl is no engine", "godot, unity or unreal"]);
    let both = ["export", "run/params.toml", "--to", "unity", "--constants", "--material", "Skin.hlsl"];
    assert_eq!(sandbox.run(&both).code, Some(2));
}

#[test]
fn a_material_for_unity_is_a_folder_beside_the_cubes() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let bake = ["bake", "scene.toml", "--params", "run/params.toml", "-o", "baked", "--cubes", "dds"];
    sandbox.run(&bake).done();
    let export = |output: &str| {
        sandbox.run(&["export", "run/params.toml", "--to", "unity", "--material", "Skin.hlsl", "-o", output])
    };
    let said = export("baked/Skin.mat").done().out;
    assert!(said.starts_with("wrote baked/Skin.mat, and beside it "), "{said}");
    let saved = sandbox.text("baked/Skin.mat");
    let shader = sandbox.text("baked/Skin.shader");
    for texture in ["Skin_color.png", "Skin_normal.png", "irradiance.dds", "hilite.dds"] {
        assert!(sandbox.path("baked").join(texture).is_file(), "{texture}");
        let meta = sandbox.text(&format!("baked/{texture}.meta"));
        let guid = meta.lines().find_map(|line| line.strip_prefix("guid: ")).unwrap();
        assert!(saved.contains(guid) && said.contains(&format!("{texture}.meta")), "{texture}: {said}");
    }
    // A constant of the fit, in 32 bits.
    let json = sandbox.run(&["export", "run/params.toml", "--to", "json"]).done().out;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let occlusion = json["constants"]["occlusion"].as_f64().unwrap() as f32;
    assert!(saved.contains(&format!("    - _SKINFIT_OCCLUSION: {occlusion}\n")), "{saved}");
    assert!(shader.contains(&format!("Float) = {occlusion}\n")), "{shader}");
    // A name that stands in the shader's text, too.
    export("baked/SHADER_BUFFER.mat").done();
    let named = sandbox.text("baked/SHADER_BUFFER.shader").replace("SHADER_BUFFER", "Skin");
    assert_eq!(named, shader);
    // Once more, nothing changes, and what Unity has made of a `.meta` stays.
    let before = sandbox.files();
    assert!(!export("baked/Skin.mat").done().out.contains(".meta"));
    assert!(sandbox.files() == before, "another export");
}

#[test]
fn a_material_for_unity_that_cannot_be_leaves_nothing() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let before = sandbox.files();
    let export =
        |more: &[&str]| sandbox.run(&[&["export", "run/params.toml", "--to", "unity", "-o"], more].concat());
    export(&["Skin.mat"]).refused(&["Skin.mat: no material holds a shader's text", "--material Skin.hlsl"]);
    let twice = export(&["Skin.mat", "--material", "Skin.shader"]);
    twice.refused(&["Skin.shader", "another file of that name"]);
    // A file stands where the folder should.
    let under = export(&["scene.toml/Skin.mat", "--material", "Skin.hlsl"]);
    assert!(under.code == Some(2) && under.err.contains("scene.toml/"), "{under:?}");
    assert!(sandbox.files() == before, "something was written");
    // What the scene reads is not written over.
    sandbox.write("Skin_color.png", &sandbox.read("color.png"));
    sandbox.edit("color = \"color.png\"", "color = \"Skin_color.png\"");
    let before = sandbox.files();
    export(&["Skin.mat", "--material", "Skin.hlsl", "--scene", "scene.toml"])
        .refused(&["Skin_color.png: the scene was read from this file", "another name or folder"]);
    assert!(sandbox.files() == before, "something was written");
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
