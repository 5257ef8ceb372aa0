//! Exported shaders are compiled by their languages' own compilers; what has none here is held against a
//! text that was read.

use std::path::Path;
use std::process::Command;

use skinfit::export::{self, Provenance, Target};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::shader::facts::MapFacts;
use skinfit::shader::{Budget, Facts, plan};

pub(crate) fn provenance() -> Provenance {
    Provenance {
        scene: "scene.toml".to_owned(),
        params: "params.toml".to_owned(),
        loss: Some(("relative_l2".to_owned(), 0.0123)),
        std_errors: vec![(Param::RimExponent, vec![0.004])],
    }
}

/// Scenes that differ in all that changes a fragment stage.
fn scenes() -> Vec<(&'static str, Facts)> {
    let maps =
        MapFacts { color: true, normal: true, specular: true, attenuator: true, ..MapFacts::default() };
    let exact = Facts { maps, budget: Budget::Within(0.05), tessellation: 1.0, ..Facts::default() };
    let setup = |form, silhouette, effects| Setup { form, silhouette, effects };
    let all = Effects::SURFACE.with(Effect::KeyLight).with(Effect::Haze);
    let corrected =
        |silhouette, effects| Facts { setup: setup(Form::Corrected, silhouette, effects), ..exact };
    vec![
        ("surface", corrected(Silhouette::Fragment, Effects::SURFACE)),
        ("everything", Facts { turned: true, morphs: 3, bones: true, ..corrected(Silhouette::Bumped, all) }),
        ("diffuse", corrected(Silhouette::Fragment, Effects::of(&[Effect::Diffuse]))),
        (
            "rim",
            Facts {
                square_rim: true,
                ..corrected(Silhouette::Vertex, Effects::of(&[Effect::Diffuse, Effect::Rim]))
            },
        ),
        ("listing", Facts { setup: setup(Form::Listing, Silhouette::Vertex, all), ..exact }),
        ("bare", Facts { maps: MapFacts::default(), ..corrected(Silhouette::Fragment, all) }),
    ]
}

fn exported(target: Target, facts: &Facts) -> String {
    export::function(target, facts, &Params::defaults(facts.setup.form), &provenance()).unwrap()
}

/// Run a compiler on `text`; its complaint, if any. A compiler that is not there is a failure: a check that
/// was not made is not passed.
fn compile(program: &str, arguments: &[&str], ending: &str, text: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(format!("shader.{ending}"));
    std::fs::write(&file, text).unwrap();
    let spirv = folder.path().join("shader.spv");
    let run = |program: &str, arguments: &[&str], files: &[&Path]| {
        let output = Command::new(program).args(arguments).args(files).output().unwrap_or_else(|error| {
            panic!("{program} cannot be run: {error}. It comes with tests/run, or from Debian's glslang-tools and spirv-tools.")
        });
        let words = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        if output.status.success() { Ok(()) } else { Err(words.concat()) }
    };
    run(program, &[arguments, &["-o", spirv.to_str().unwrap()]].concat(), &[&file])?;
    run("spirv-val", &[], &[&spirv])
}

/// Fields of the function's input, in a language with `float3`-like types.
fn inputs(facts: &Facts, spell: impl Fn(usize, &str, &str) -> String) -> String {
    let fields = plan(facts).unwrap().surface();
    fields.iter().enumerate().map(|(i, (name, kind))| spell(i, name, kind)).collect()
}

#[test]
fn exported_glsl_is_taken_by_glslang_and_its_code_is_valid() {
    for (name, facts) in scenes() {
        let kind = |wgsl: &str| match wgsl {
            "f32" => "float",
            "vec2f" => "vec2",
            _ => "vec3",
        };
        let declared = inputs(&facts, |i, field, wgsl| {
            format!("layout(location = {i}) in {} in_{field};\n", kind(wgsl))
        });
        let set = inputs(&facts, |_, field, _| format!("    at.{field} = in_{field};\n"));
        let text = format!(
            "#version 450\n{}\n{declared}layout(location = 0) out vec4 color;\nvoid main() {{\n    Surface at;\n{set}    color = skinfit_shade(at);\n}}\n",
            exported(Target::Glsl, &facts)
        );
        compile("glslangValidator", &["-V", "-S", "frag"], "frag", &text)
            .unwrap_or_else(|error| panic!("{name}: {error}\n{text}"));
    }
}

#[test]
fn exported_hlsl_is_taken_by_glslang_and_its_code_is_valid_for_unity_too() {
    for target in [Target::Hlsl, Target::Unity] {
        for (name, facts) in scenes() {
            let kind = |wgsl: &str| match wgsl {
                "f32" => "float",
                "vec2f" => "float2",
                _ => "float3",
            };
            let declared =
                inputs(&facts, |i, field, wgsl| format!("    {} {field} : TEXCOORD{i};\n", kind(wgsl)));
            let set = inputs(&facts, |_, field, _| format!("    at.{field} = input.{field};\n"));
            let text = format!(
                "{}\nstruct Input {{\n{declared}}};\nfloat4 main(Input input) : SV_Target {{\n    Surface at;\n{set}    return skinfit_shade(at);\n}}\n",
                exported(target, &facts)
            );
            let arguments = ["-D", "-V", "-S", "frag", "-e", "main", "--auto-map-bindings"];
            compile("glslangValidator", &arguments, "hlsl", &text)
                .unwrap_or_else(|error| panic!("{} {name}: {error}\n{text}", target.name()));
        }
    }
}

#[test]
fn exported_wgsl_is_taken_by_naga() {
    for (name, facts) in scenes() {
        let text = exported(Target::Wgsl, &facts);
        let module = naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|e| panic!("{name}: {}\n{text}", e.emit_to_string(&text)));
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}\n{text}", e.emit_to_string(&text)));
    }
}

/// Languages without a compiler in Debian: texts that were read by a person, renewed with
/// SKINFIT_UPDATE_SNAPSHOTS=1.
#[test]
fn exports_that_no_compiler_here_takes_are_as_they_were_when_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/snapshots");
    let facts = scenes()[0].1;
    for (target, ending) in [(Target::Cg, "cg"), (Target::Msl, "metal"), (Target::Godot, "gdshaderinc")] {
        let path = folder.join(format!("skin.{ending}"));
        let text = exported(target, &facts).replace(env!("CARGO_PKG_VERSION"), "VERSION");
        if std::env::var_os("SKINFIT_UPDATE_SNAPSHOTS").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, kept, "{}: read the new text, then renew {}", target.name(), path.display());
    }
}

#[test]
fn constants_alone_read_back_as_they_were() {
    let effects = Effects::SURFACE;
    let mut params = Params::defaults(Form::Corrected);
    params.set_rgb(Param::Hilite, [0.1 + 0.2, 1e-17, 3e20]);
    params.set(Param::RimExponent, 1.0 / 3.0);
    let text = |target| export::constants(target, effects, &params, &provenance());
    let json: serde_json::Value = serde_json::from_str(&text(Target::Json)).unwrap();
    let toml: toml::Table = text(Target::Toml).parse().unwrap();
    for param in Param::all() {
        let asked = param.asked_for(effects);
        assert_eq!(json["constants"].get(param.name()).is_some(), asked, "{}", param.name());
        assert_eq!(toml.contains_key(param.name()), asked, "{}", param.name());
    }
    assert_eq!(json["constants"]["rim_exponent"].as_f64(), Some(1.0 / 3.0));
    assert_eq!(toml["rim_exponent"].as_float(), Some(1.0 / 3.0));
    for (c, want) in params.rgb(Param::Hilite).into_iter().enumerate() {
        assert_eq!(json["constants"]["hilite"][c].as_f64(), Some(want));
        assert_eq!(toml["hilite"][c].as_float(), Some(want));
    }
    assert!(text(Target::C).contains("static const float skinfit_occlusion = 1.0f;"));
    assert_eq!(json["std_errors"]["rim_exponent"].as_f64(), Some(0.004));
}

#[test]
fn a_c_header_compiles() {
    let text =
        export::constants(Target::C, Effects::SURFACE, &Params::defaults(Form::Corrected), &provenance());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("skin.h");
    std::fs::write(&file, text).unwrap();
    let made = Command::new("cc")
        .args([
            "-fsyntax-only",
            "-x",
            "c",
            "-Wall",
            "-Wno-unused-const-variable",
            "-Wno-unused-variable",
            "-Werror",
        ])
        .arg(&file)
        .status()
        .unwrap();
    assert!(made.success());
}

#[test]
fn data_formats_hold_no_shader_and_say_so() {
    let facts = scenes()[0].1;
    for target in [Target::C, Target::Json, Target::Toml] {
        let error = export::function(target, &facts, &Params::defaults(Form::Corrected), &provenance());
        let words = error.unwrap_err().to_string();
        assert!(
            words.contains(target.name()) && words.contains("--constants") && words.contains("glsl"),
            "{words}"
        );
    }
}
