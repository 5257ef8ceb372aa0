//! Materials around exported shaders, compiled as far as a compiler is at hand: what an engine brings along is declared
//! here, by its documentation.

use skinfit::export::{self, Provenance, Target};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::Params;
use skinfit::shader::Facts;

use crate::exports::{compile_stage, engine_facts, godot_in_glsl};

/// What Unity's `UnityCG.cginc` and its constants give (Unity's manual, "Built-in shader helper functions").
const UNITY_CG: &str = "
#define CBUFFER_START(name) cbuffer name {
#define CBUFFER_END };
float4x4 unity_ObjectToWorld;
float4x4 unity_MatrixVP;
float4 unity_WorldTransformParams;
float3 _WorldSpaceCameraPos;
float3 UnityObjectToWorldNormal(float3 v) { return normalize(mul((float3x3)unity_ObjectToWorld, v)); }
float3 UnityObjectToWorldDir(float3 v) { return normalize(mul((float3x3)unity_ObjectToWorld, v)); }
float4 UnityObjectToClipPos(float4 v) { return mul(unity_MatrixVP, mul(unity_ObjectToWorld, v)); }
";

/// What Godot's stages of a spatial shader read and write (Godot's documentation, "Spatial shaders").
const GODOT_VERTEX: &str = "
const mat4 MODEL_MATRIX = mat4(1.0);
const mat3 MODEL_NORMAL_MATRIX = mat3(1.0);
layout(location = 10) in vec3 VERTEX;
layout(location = 11) in vec3 NORMAL;
layout(location = 12) in vec3 TANGENT;
layout(location = 13) in vec3 BINORMAL;
";
const GODOT_FRAGMENT: &str = "
const vec3 CAMERA_POSITION_WORLD = vec3(0.0);
layout(location = 10) in vec2 UV;
layout(location = 11) in vec2 UV2;
layout(location = 0) out vec3 ALBEDO;
";
const GLSL_ES: &str = "#version 310 es\nprecision highp float;\nprecision highp int;\n";

/// Scenes whose materials differ.
fn scenes() -> Vec<Facts> {
    let of = |effects| Facts {
        setup: Setup::new(Form::Corrected, Silhouette::Fragment, effects),
        ..engine_facts()
    };
    vec![
        of(Effects::SURFACE),
        of(Effects::of(&[Effect::Diffuse])),
        of(Effects::SURFACE.with(Effect::KeyLight)),
    ]
}

/// The shader and its material.
fn exported(target: Target, facts: &Facts, name: &str) -> (String, String) {
    let params = Params::defaults(facts.setup.form);
    let shader = export::function(target, facts, &params, &Provenance::default()).unwrap();
    (shader, export::material(target, facts, &params, name).unwrap())
}

/// A text with its part replaced, which has to be there.
pub(crate) fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from} is not there: {text}");
    text.replacen(from, to, 1)
}

#[test]
fn unitys_material_is_hlsl_around_the_shader() {
    for facts in scenes() {
        let (shader, material) = exported(Target::Unity, &facts, "Skin.hlsl");
        let (_, code) = material.split_once("HLSLPROGRAM\n").unwrap();
        let (code, _) = code.split_once("ENDHLSL").unwrap();
        let code = replaced(code, "#include \"UnityCG.cginc\"", UNITY_CG);
        let code = replaced(&code, "#include \"Skin.hlsl\"", &format!("\n{shader}\n"));
        for (stage, entry) in [("vert", "skin_vertex"), ("frag", "skin_fragment")] {
            assert!(code.contains(entry), "{code}");
            let found = compile_stage(stage, entry, &code);
            found.unwrap_or_else(|error| panic!("{stage}: {error}\n{code}"));
            let spoilt = replaced(&code, "turned(", "turnt(");
            assert!(compile_stage(stage, entry, &spoilt).is_err(), "{stage}: anything is taken");
            // The constants are the material's: the include defines none then.
            let spoilt = replaced(&code, "#define SKINFIT_MATERIAL\n", "");
            assert!(compile_stage(stage, entry, &spoilt).is_err(), "{stage}: constants twice");
        }
    }
}

/// A stage of Godot's shader as GLSL ES: its varyings go out of the one and into the other.
fn godot_stage(code: &str, stage: &str) -> String {
    let (mut text, mut location) = (String::new(), 0);
    let way = if stage == "vertex" { "out" } else { "in" };
    let mut inside_other = false;
    for line in code.lines() {
        inside_other |= line.starts_with("void ") && !line.starts_with(&format!("void {stage}("));
        match line.strip_prefix("varying ") {
            Some(declared) => {
                text += &format!("layout(location = {location}) {way} {declared}\n");
                location += 1;
            }
            None if inside_other || line.starts_with("shader_type") || line.starts_with("render_mode") => {}
            None => text += &format!("{line}\n"),
        }
        inside_other &= line != "}";
    }
    replaced(&text, &format!("void {stage}("), "void main(")
}

/// The shader within a material of Godot, and the lines behind it.
pub(crate) fn godots_code(material: &str) -> (String, &str) {
    let (_, code) = material.split_once("\ncode = \"").unwrap();
    let (code, values) = code.split_once("\"\n\n[resource]").unwrap();
    (code.replace("\\\"", "\"").replace("\\\\", "\\"), values)
}

#[test]
fn godots_material_is_its_language_around_the_shader() {
    for facts in scenes() {
        let (shader, material) = exported(Target::Godot, &facts, "res://skin.gdshaderinc");
        let (code, values) = godots_code(&material);
        let include = "#include \"res://skin.gdshaderinc\"";
        for (stage, short, given) in [("vertex", "vert", GODOT_VERTEX), ("fragment", "frag", GODOT_FRAGMENT)]
        {
            let own = replaced(&godot_stage(&code, stage), include, "");
            let text = [GLSL_ES, &godot_in_glsl(&shader), given, &own].concat();
            let found = compile_stage(short, "main", &text);
            found.unwrap_or_else(|error| panic!("{stage}: {error}\n{text}"));
            let spoilt = replaced(&text, "skin_normal", "skin_norml");
            assert!(compile_stage(short, "main", &spoilt).is_err(), "{stage}: anything is taken");
        }
        // What is given a value is a uniform of the shader, and each of these is.
        let uniforms = shader.lines().filter_map(|line| line.strip_prefix("uniform ")?.split(' ').nth(1));
        for uniform in uniforms {
            assert!(values.contains(&format!("shader_parameter/{uniform} = ExtResource(\"")), "{values}");
        }
        assert_eq!(values.matches("shader_parameter/").count(), material.matches("[ext_resource ").count());
    }
}
