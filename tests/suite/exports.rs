//! Exported shaders are compiled by their languages' own compilers. What has none here is taken back to a sibling
//! language that has one by the few words in which they differ, compiled there, and held against a text that was read.

use std::path::Path;
use std::process::Command;

use skinfit::export::{self, Constants, Provenance, Target};
use skinfit::fit::params_file::ParamsFile;
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::gain::Gain;
use skinfit::model::params::{Param, Params};
use skinfit::model::texture_filter::TextureFilter;
use skinfit::shader::facts::MapFacts;
use skinfit::shader::{Facts, plan};

use crate::unreal::unreal_in_hlsl;

pub(crate) fn provenance() -> Provenance {
    Provenance {
        scene: Some("scene.toml".to_owned()),
        params: "params.toml".to_owned(),
        loss: Some(("relative_l2".to_owned(), 0.0123)),
        set: Vec::new(),
        std_errors: vec![(Param::RimExponent, vec![0.004])],
    }
}

/// What an engine's scene calls for.
pub(crate) fn engine_facts() -> Facts {
    let maps =
        MapFacts { color: true, normal: true, specular: true, attenuator: true, ..MapFacts::default() };
    Facts { maps, budget: export::BUDGET, tessellation: 1.0, ..Facts::default() }
}

/// Scenes that differ in all that changes a fragment stage.
fn scenes() -> Vec<(&'static str, Facts)> {
    let exact = engine_facts();
    let setup = |form, silhouette, effects| Setup::new(form, silhouette, effects);
    let all = Effects::SURFACE.with(Effect::KeyLight).with(Effect::Haze);
    let corrected =
        |silhouette, effects| Facts { setup: setup(Form::Corrected, silhouette, effects), ..exact };
    let filtered = |filter| Facts { maps: MapFacts { filter, ..exact.maps }, ..exact };
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
        (
            "as_interpolated",
            Facts {
                setup: Setup { interpolated_rim: true, ..setup(Form::Listing, Silhouette::Vertex, all) },
                square_rim: true,
                ..exact
            },
        ),
        (
            "second_version",
            Facts {
                setup: Setup {
                    lookups: Lookups::Smooth,
                    dapple: Dapple::new([0.48, -0.36, 0.8], 30.0, false),
                    ..setup(Form::Corrected, Silhouette::Fragment, all)
                },
                turned: true,
                ..exact
            },
        ),
        ("mip_maps", filtered(TextureFilter::Trilinear)),
        ("anisotropic", filtered(TextureFilter::Anisotropic)),
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

/// GLSL's name of a type.
pub(crate) fn glsl_kind(wgsl: &str) -> &'static str {
    match wgsl {
        "f32" => "float",
        "vec2f" => "vec2",
        _ => "vec3",
    }
}

/// A fragment shader in a sibling of GLSL that hands its inputs to the exported function.
fn glsl_shader(head: &str, facts: &Facts, exported: &str) -> String {
    let declared = inputs(facts, |i, field, wgsl| {
        format!("layout(location = {i}) in {} in_{field};\n", glsl_kind(wgsl))
    });
    let set = inputs(facts, |_, field, _| format!("    at.{field} = in_{field};\n"));
    format!(
        "{head}\n{exported}\n{declared}layout(location = 0) out vec4 color;\nvoid main() {{\n    SkinfitSurface at;\n{set}    color = skinfit_shade(at);\n}}\n"
    )
}

/// As [`glsl_shader`], in a sibling of HLSL.
fn hlsl_shader(head: &str, facts: &Facts, exported: &str) -> String {
    let kind = |wgsl: &str| match wgsl {
        "f32" => "float",
        "vec2f" => "float2",
        _ => "float3",
    };
    let declared = inputs(facts, |i, field, wgsl| format!("    {} {field} : TEXCOORD{i};\n", kind(wgsl)));
    let set = inputs(facts, |_, field, _| format!("    at.{field} = input.{field};\n"));
    format!(
        "{head}\n{exported}\nstruct Input {{\n{declared}}};\nfloat4 main(Input input) : SV_Target {{\n    SkinfitSurface at;\n{set}    return skinfit_shade(at);\n}}\n"
    )
}

pub(crate) fn compile_glsl(text: &str) -> Result<(), String> {
    compile("glslangValidator", &["-V", "-S", "frag"], "frag", text)
}

pub(crate) fn compile_hlsl(text: &str) -> Result<(), String> {
    compile(
        "glslangValidator",
        &["-D", "-V", "-S", "frag", "-e", "main", "--auto-map-bindings"],
        "hlsl",
        text,
    )
}

/// A stage of a whole shader, HLSL unless it begins with a version of GLSL.
pub(crate) fn compile_stage(stage: &str, entry: &str, text: &str) -> Result<(), String> {
    let own = ["-V", "-S", stage, "-e", entry, "--auto-map-bindings", "--auto-map-locations"];
    match text.starts_with("#version") {
        true => compile("glslangValidator", &["-V", "-S", stage], stage, text),
        false => compile("glslangValidator", &[&["-D"], &own[..]].concat(), "hlsl", text),
    }
}

/// A text that a compiler has taken, and must not take with any of `faults` in it: so that what it says is worth
/// something.
fn assert_taken(compile: fn(&str) -> Result<(), String>, name: &str, text: &str, faults: &[(&str, &str)]) {
    compile(text).unwrap_or_else(|error| panic!("{name}: {error}\n{text}"));
    for (right, wrong) in faults {
        assert!(text.contains(right), "{name} holds no {right}\n{text}");
        let spoilt = text.replacen(right, wrong, 1);
        assert!(compile(&spoilt).is_err(), "{name}: {wrong} is taken for {right}");
    }
}

#[test]
fn exported_glsl_is_taken_by_glslang_and_its_code_is_valid() {
    for (name, facts) in scenes() {
        compiled_glsl(name, &facts);
    }
}

/// The exported GLSL of a scene, which glslang takes.
pub(crate) fn compiled_glsl(name: &str, facts: &Facts) -> String {
    let text = glsl_shader("#version 450", facts, &exported(Target::Glsl, facts));
    assert_taken(compile_glsl, name, &text, &[]);
    text
}

#[test]
fn exported_hlsl_is_taken_by_glslang_and_its_code_is_valid_for_unity_and_unreal_too() {
    for target in [Target::Hlsl, Target::Unity, Target::Unreal] {
        for (name, facts) in scenes() {
            let exported = exported(target, &facts);
            let plain = if target == Target::Unreal { unreal_in_hlsl(&exported) } else { exported };
            let text = hlsl_shader("", &facts, &plain);
            assert_taken(compile_hlsl, &format!("{} {name}", target.name()), &text, &[]);
        }
    }
}

/// What Cg is to HLSL: samplers that are one with their textures, and other names of lookups.
pub(crate) const CG_IN_HLSL: &str = "SamplerState map_sampler;
SamplerState cube_sampler;
#define sampler2D Texture2D<float4>
#define samplerCUBE TextureCube<float4>
#define tex2D(t, c) t.Sample(map_sampler, c)
#define tex2Dlod(t, c) t.SampleLevel(map_sampler, (c).xy, (c).w)
#define texCUBElod(t, c) t.SampleLevel(cube_sampler, (c).xyz, (c).w)
#define tex2Dfetch(t, c) t.Load(int3((c).xy, (c).w))";

#[test]
fn exported_cg_is_hlsl_but_for_its_lookups() {
    for (name, facts) in scenes() {
        let exported = exported(Target::Cg, &facts);
        // Words of its siblings that Cg has not: `bits` of floats came with later profiles.
        for word in
            ["SampleLevel", "Texture2D", "register(", "asuint", "vec3", "mix(", "fract(", "textureLod"]
        {
            assert!(!exported.contains(word), "{name}: {word}\n{exported}");
        }
        let text = hlsl_shader(CG_IN_HLSL, &facts, &exported);
        assert_taken(compile_hlsl, name, &text, &[("float4 skinfit_shade(", "vec4 skinfit_shade(")]);
    }
}

/// Godot's language in GLSL ES, which it is a dialect of and which converts as few types by itself: its uniforms have
/// hints in place of bindings.
pub(crate) fn godot_in_glsl(exported: &str) -> String {
    let mut bindings = 0;
    let mut line = |line: &str| {
        let Some(declared) = line.strip_prefix("uniform ") else { return line.to_owned() + "\n" };
        let (what, hints) = declared.trim_end_matches(';').split_once(" : ").unwrap_or((declared, ""));
        for hint in hints.split(", ") {
            // Those of Godot 4's shading language.
            const HINTS: [&str; 6] = [
                "filter_nearest",
                "source_color",
                "filter_linear",
                "filter_linear_mipmap",
                "filter_linear_mipmap_anisotropic",
                "repeat_enable",
            ];
            assert!(HINTS.contains(&hint), "{line}");
        }
        bindings += 1;
        format!("layout(binding = {bindings}) uniform {what};\n")
    };
    exported.lines().map(&mut line).collect()
}

#[test]
fn exported_godot_is_glsl_es_but_for_its_hints() {
    const HEAD: &str = "#version 310 es\nprecision highp float;\nprecision highp int;";
    for (name, facts) in scenes() {
        let exported = exported(Target::Godot, &facts);
        assert!(!exported.contains("layout(") && !exported.contains("#version"), "{name}\n{exported}");
        // Colours are decoded from sRGB by the engine, and nothing else is.
        let decoded = exported.lines().filter(|line| line.contains("source_color")).collect::<Vec<_>>();
        let color = if facts.maps.color { 1 } else { 0 };
        assert!(
            decoded.len() == color && decoded.iter().all(|line| line.contains(" skinfit_color_map ")),
            "{decoded:?}"
        );
        let text = glsl_shader(HEAD, &facts, &godot_in_glsl(&exported));
        assert_taken(
            compile_glsl,
            name,
            &text,
            &[("largest : 1.0", "largest : 1"), ("vec4 skinfit_shade(", "float4 skinfit_shade(")],
        );
    }
}

/// Metal's language in HLSL. There a struct holds the textures, of which HLSL has none: it is opened.
pub(crate) fn metal_in_hlsl(exported: &str) -> String {
    let (before, inside) = exported.split_once("struct Skinfit {\n").expect("a struct of textures");
    let inside = inside.trim_end().strip_suffix("};").expect("the struct's end");
    let before = before.replace("#include <metal_stdlib>", "").replace("using namespace metal;", "");
    let text = before + inside;
    let text = text.replace("<float>", "<float4>").replace("as_type<uint3>", "asuint");
    // Without a level, it is another function in HLSL.
    let text =
        text.replace(".sample(skinfit_map_sampler, vertex_uv)", ".Sample(skinfit_map_sampler, vertex_uv)");
    let defined = [
        ("constant", "static const"),
        ("texture2d", "Texture2D"),
        ("texturecube", "TextureCube"),
        ("sampler", "SamplerState"),
        ("sample", "SampleLevel"),
        ("level(x)", "x"),
        ("mix", "lerp"),
        ("fract", "frac"),
        ("read(at, level)", "Load(int3(at, level))"),
        ("dfdx", "ddx"),
        ("dfdy", "ddy"),
    ];
    defined.iter().map(|(metal, hlsl)| format!("#define {metal} {hlsl}\n")).collect::<String>() + &text
}

#[test]
fn exported_metal_is_hlsl_but_for_its_struct_and_lookups() {
    for (name, facts) in scenes() {
        let exported = exported(Target::Msl, &facts);
        for word in ["SampleLevel", "static const", "asuint", "lerp(", "frac(", "vec3", "uniform"] {
            assert!(!exported.contains(word), "{name}: {word}\n{exported}");
        }
        // Constants stand outside the struct, in the one address space that Metal allows there.
        let (constants, functions) = exported.split_once("struct Skinfit {").unwrap();
        assert!(
            constants.contains("\nconstant float") && !functions.contains("constant float"),
            "{exported}"
        );
        let text = hlsl_shader("", &facts, &metal_in_hlsl(&exported));
        assert_taken(compile_hlsl, name, &text, &[("float4 skinfit_shade(", "vec4 skinfit_shade(")]);
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

/// Constants of the paper's fragment program, fitted to two views.
fn constants(target: Target, params: &Params) -> String {
    let gains = [("front".to_owned(), 1.0.into()), ("side.2".to_owned(), Gain([0.1 + 0.2, 1.0, 1.0 / 3.0]))];
    let loss = Some("relative_l2");
    let constants =
        Constants { form: Form::Corrected, effects: Effects::SURFACE, params, loss, gains: &gains };
    export::constants(target, constants, &provenance())
}

#[test]
fn constants_alone_read_back_as_they_were() {
    let effects = Effects::SURFACE;
    let mut params = Params::defaults(Form::Corrected);
    params.set_rgb(Param::Hilite, [0.1 + 0.2, 1e-17, 3e8]);
    params.set(Param::RimExponent, 1.0 / 3.0);
    let json: serde_json::Value = serde_json::from_str(&constants(Target::Json, &params)).unwrap();
    let toml: toml::Table = constants(Target::Toml, &params).parse().unwrap();
    for param in Param::built_in() {
        let asked = param.asked_for(effects);
        assert_eq!(json["constants"].get(param.name()).is_some(), asked, "{}", param.name());
        assert_eq!(toml["params"].get(param.name()).is_some(), asked, "{}", param.name());
    }
    assert_eq!(json["constants"]["rim_exponent"].as_f64(), Some(1.0 / 3.0));
    for (c, want) in params.rgb(Param::Hilite).into_iter().enumerate() {
        assert_eq!(json["constants"]["hilite"][c].as_f64(), Some(want));
    }
    assert!(constants(Target::C, &params).contains("static const float skinfit_occlusion = 1.0f;"));
    assert_eq!(json["std_errors"]["rim_exponent"].as_f64(), Some(0.004));
    assert_eq!((json["form"].as_str(), json["effects"][0].as_str()), (Some("corrected"), Some("diffuse")));
}

#[test]
fn constants_as_toml_are_a_file_of_parameters() {
    let mut params = Params::defaults(Form::Corrected);
    params.set_rgb(Param::Hilite, [0.1 + 0.2, 1e-17, 3e8]);
    params.set(Param::RimExponent, 1.0 / 3.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.toml");
    std::fs::write(&path, constants(Target::Toml, &params)).unwrap();
    let file = ParamsFile::read(&path, Form::Corrected, &Params::defaults(Form::Corrected)).unwrap();
    // To the bit.
    assert_eq!((file.params, file.form, file.effects), (params, Form::Corrected, Some(Effects::SURFACE)));
    assert_eq!(file.loss.map(skinfit::scene::Loss::name), Some("relative_l2"));
    assert_eq!(
        file.gains,
        [("front".to_owned(), 1.0.into()), ("side.2".to_owned(), Gain([0.1 + 0.2, 1.0, 1.0 / 3.0]))]
    );
}

#[test]
fn a_c_header_compiles_however_often_it_is_included() {
    let folder = tempfile::tempdir().unwrap();
    let header = constants(Target::C, &Params::defaults(Form::Corrected));
    std::fs::write(folder.path().join("skin.h"), &header).unwrap();
    let file = folder.path().join("main.c");
    std::fs::write(
        &file,
        "#include \"skin.h\"\n#include \"skin.h\"\nfloat hilite(void) { return skinfit_hilite[2]; }\n",
    )
    .unwrap();
    let made = Command::new("cc")
        .args(["-fsyntax-only", "-Wall", "-Wno-unused-const-variable", "-Wno-unused-variable", "-Werror"])
        .arg(&file)
        .status()
        .unwrap();
    assert!(made.success());
    // Whatever it defines has the prefix.
    let code = header.lines().filter(|line| !line.starts_with("//"));
    for line in code.filter(|line| line.starts_with("static") || line.starts_with("#define")) {
        assert!(line.to_lowercase().contains(" skinfit_"), "{line}");
    }
}

/// The names that `text` defines at its top level, as each language writes it.
fn defined(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with("//")) {
        let line = line.trim_start_matches("    ");
        let before = |end: char| line.split(end).next().unwrap_or_default();
        let last = |words: &str| words.split([' ', '>']).rfind(|word| !word.is_empty()).map(str::to_owned);
        let constant = ["const ", "static const ", "constant "].iter().any(|word| line.starts_with(word));
        let resource = ["uniform ", "layout(", "Texture", "Sampler", "texture", "sampler ", "@group"]
            .iter()
            .any(|word| line.starts_with(word));
        names.extend(match () {
            () if line.starts_with("struct ") => last(before('{')),
            () if line.starts_with("#define ") => line.split(' ').nth(1).map(str::to_owned),
            // `const NAME: f32 = 1.0;` or `const float NAME = 1.0;`
            () if constant => last(before('=').split(':').next().unwrap_or_default().trim_end()),
            () if line.starts_with("@group") => last(line.split(": ").next().unwrap_or_default()),
            () if line.starts_with("layout(") || resource => {
                last(before(';').split(" : ").next().unwrap_or_default())
            }
            () if line.starts_with("fn ") => last(before('(')),
            // `float3 name(float2 a) {`, and neither a call nor an `if`.
            () if line.ends_with(") {") && !line.starts_with("if ") => last(before('(')),
            () => None,
        });
    }
    names
}

#[test]
fn whatever_an_export_defines_has_its_prefix() {
    for target in Target::ALL.into_iter().filter(|target| target.dialect().is_some()) {
        for (name, facts) in scenes() {
            let text = exported(target, &facts);
            let names = defined(&text);
            // Functions, at least one constant, the input and its shader.
            assert!(names.len() > 4, "{} {name}: {names:?}", target.name());
            let bare = names.iter().find(|defined| !defined.to_lowercase().starts_with("skinfit"));
            assert!(bare.is_none(), "{} {name}: {bare:?} has no prefix\n{text}", target.name());
            assert!(names.iter().any(|defined| defined == "skinfit_shade"), "{names:?}");
            assert!(names.iter().any(|defined| defined == "SkinfitSurface"), "{names:?}");
        }
    }
}

#[test]
fn an_export_cites_what_its_reader_can_find() {
    for (name, facts) in scenes() {
        let text = exported(Target::Glsl, &facts);
        assert!(!text.contains("MODEL "), "{name}: {text}");
        assert!(text.contains("docs/model.md"), "{name}");
    }
}

#[test]
fn terms_without_weight_are_left_out_and_said_to_be() {
    let (_, facts) = scenes()[0];
    let mut params = Params::defaults(Form::Corrected);
    let whole = export::function(Target::Glsl, &facts, &params, &provenance()).unwrap();
    assert!(!whole.contains("Left out"), "{whole}");
    params.set(Param::Reflection, 0.0);
    params.set(Param::Hilite, 0.0);
    let less = export::function(Target::Glsl, &facts, &params, &provenance()).unwrap();
    assert!(less.contains("// Left out, as their weight is 0: hilite, reflection. "), "{less}");
    for name in ["SKINFIT_REFLECTION", "SKINFIT_HILITE", "hilite_cube", "attenuator"] {
        assert!(whole.contains(name) && !less.contains(name), "{name}: {less}");
    }
    // What is left is what is planned without the two, which costs less.
    let setup = Setup {
        effects: Effects::SURFACE.without(Effect::Hilite).without(Effect::Reflection),
        ..facts.setup
    };
    let planned = plan(&Facts { setup, ..facts }).unwrap();
    assert!(planned.cost < 0.9 * plan(&facts).unwrap().cost, "{}", planned.cost);
    assert!(less.lines().count() < whole.lines().count());
}

#[test]
fn an_interpolated_rim_is_handed_to_the_function_with_its_exponent() {
    let (_, facts) = scenes().into_iter().find(|(name, _)| *name == "as_interpolated").unwrap();
    let text = exported(Target::Glsl, &facts);
    assert!(text.contains("float vertex_rim;") && !text.contains("vertex_silhouette"), "{text}");
    assert!(text.contains("- vertex_rim: (1 - |N.V|) ^ 2.0 of the vertex, as interpolated"), "{text}");
}

#[test]
fn the_second_version_reads_two_normals_and_the_axis_of_its_dapple() {
    let (_, facts) = scenes().into_iter().find(|(name, _)| *name == "second_version").unwrap();
    let mut params = Params::defaults(Form::Corrected);
    params.set(Param::KeyColor, 0.5);
    let text = export::function(Target::Glsl, &facts, &params, &provenance()).unwrap();
    let [x, y, z] = facts.setup.dapple.axis();
    assert!(text.contains(&format!("return vec3({x:?}, {y:?}, {z:?});")), "{text}");
    // Cubes along N, the key light along n.
    assert!(
        text.contains("skinfit_turned_n(lookup_normal") && text.contains("(albedo, n, normal,"),
        "{text}"
    );
}

#[test]
fn data_formats_hold_no_shader_and_say_so() {
    let facts = scenes()[0].1;
    for target in [Target::C, Target::Json, Target::Toml] {
        let error = export::function(target, &facts, &Params::defaults(Form::Corrected), &provenance());
        let words = error.unwrap_err().to_string();
        assert!(
            words.contains(target.name()) && words.contains("the constants alone") && words.contains("glsl"),
            "{words}"
        );
    }
}

#[test]
fn exports_filter_maps_as_the_scene_does() {
    let facts = engine_facts();
    let filtered = |filter| Facts { maps: MapFacts { filter, ..facts.maps }, ..facts };
    // What says in each language that a map is read at the level that fits the fragment, and how.
    for (target, trilinear, anisotropic) in [
        (Target::Wgsl, "textureSample(skinfit_color_map, skinfit_map_sampler, vertex_uv)", "textureSample("),
        (Target::Glsl, "texture(skinfit_color_map, vertex_uv)", "texture("),
        (Target::Hlsl, "skinfit_color_map.Sample(skinfit_map_sampler, vertex_uv)", ".Sample("),
        (Target::Cg, "tex2D(skinfit_color_map, vertex_uv)", "tex2D("),
        (Target::Msl, "skinfit_color_map.sample(skinfit_map_sampler, vertex_uv)", "vertex_uv)"),
        (
            Target::Godot,
            ": source_color, filter_linear_mipmap, repeat_enable",
            "filter_linear_mipmap_anisotropic, repeat",
        ),
        (
            Target::Unity,
            "SamplerState skinfit_trilinear_repeat_sampler;",
            "Sample(skinfit_trilinear_repeat_aniso16_sampler",
        ),
        (
            Target::Unreal,
            "Texture2DSample(skinfit_color_map, skinfit_color_mapSampler, vertex_uv)",
            "Texture2DSample(",
        ),
    ] {
        let name = target.name();
        let bilinear = exported(target, &facts);
        let [two, sixteen] = [TextureFilter::Trilinear, TextureFilter::Anisotropic]
            .map(|filter| exported(target, &filtered(filter)));
        assert!(
            !bilinear.contains(trilinear) && !bilinear.contains("mip levels and a sampler"),
            "{name}\n{bilinear}"
        );
        assert!(two.contains(trilinear) && two.contains("a sampler that is trilinear"), "{name}\n{two}");
        assert!(
            sixteen.contains(anisotropic) && sixteen.contains("that is anisotropic"),
            "{name}\n{sixteen}"
        );
    }
    // Cubes keep their one level.
    let cube = "textureSampleLevel(skinfit_hilite_cube, skinfit_cube_sampler";
    assert!(exported(Target::Wgsl, &filtered(TextureFilter::Trilinear)).contains(cube));
}
