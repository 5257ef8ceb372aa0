//! The shader of a material: a ShaderLab file.
//!
//! Its properties are the cubes and maps, and the constants: a project's materials share one shader, and each has values of
//! its own. In the include stand the same values, for shaders that declare nothing.

use super::Tuned;
use crate::export::ExportError;
use crate::export::material::{Bound, Members, Parts};

/// Unity's X is glTF's, mirrored; the vertex stage has turned it back.
const MEMBERS: Members = [
    ("vertex_position", "from.position"),
    ("vertex_normal", "from.normal"),
    ("vertex_tangent", "from.tangent"),
    ("vertex_bitangent", "from.bitangent"),
    ("vertex_uv", "from.uv.xy"),
    ("vertex_occlusion", "from.uv.z"),
    ("eye", "turned(_WorldSpaceCameraPos)"),
];

/// A ShaderLab file (Unity's manual, "ShaderLab"): unlit, for the built-in pipeline and URP. `title` is its name in Unity's
/// list of shaders.
pub(in crate::export::material) fn text(parts: &Parts<'_>, title: &str) -> Result<String, ExportError> {
    let property = |Bound { name, cube, words, .. }: Bound| {
        let (kind, neutral) = if cube { ("Cube", "black") } else { ("2D", "white") };
        let words = words.replace('"', "'");
        format!("        [NoScaleOffset] {name} (\"{words}\", {kind}) = \"{neutral}\" {{}}\n")
    };
    let tuned = super::tuned(parts);
    let properties: String = parts.bound().map(property).chain(tuned.iter().map(of_constant)).collect();
    let filled = parts.filled(&MEMBERS, "                ")?;
    Ok(SHADER
        // Names first: what they are replaced by has none of the marks below.
        .replace("@TITLE@", &title.replace(['"', '/', '\\', '@'], ""))
        .replace("@INCLUDE@", &parts.shader.replace(['"', '@'], ""))
        .replace("@PROPERTIES@\n", &properties)
        .replace("@BUFFER@\n", &buffer(&tuned))
        .replace("@FILLED@\n", &filled))
}

/// A constant as a property. A *Vector* has its numbers as they are; a *Color* would be decoded from sRGB.
fn of_constant(constant: &Tuned) -> String {
    let Tuned { property, words, .. } = constant;
    let words = words.replace('"', "'");
    match constant.four() {
        None => format!("        {property} (\"{words}\", Float) = {}\n", constant.value[0]),
        Some([x, y, z, w]) => format!("        {property} (\"{words}\", Vector) = ({x}, {y}, {z}, {w})\n"),
    }
}

/// The constants as the shader's stages read them: properties are numbers or have four of them (Unity's manual, "Add material
/// properties"), and the batcher of scriptable pipelines wants them in a buffer of this name ("Scriptable Render Pipeline
/// Batcher").
fn buffer(tuned: &[Tuned]) -> String {
    let line = |text: &str| format!("            {text}\n");
    if tuned.is_empty() {
        return String::new();
    }
    let mut text = line("// The material's constants, in place of the include's own.");
    text += &line("CBUFFER_START(UnityPerMaterial)");
    for constant in tuned {
        let kind = if constant.four().is_some() { "float4" } else { "float" };
        text += &line(&format!("    {kind} {};", constant.property));
    }
    text += &line("CBUFFER_END");
    text += &line("#define SKINFIT_MATERIAL");
    for Tuned { property, name, value, .. } in tuned {
        let part = ["", "", ".xy", ".xyz"].get(value.len()).unwrap_or(&"");
        text += &line(&format!("#define {name} {property}{part}"));
    }
    text
}

const SHADER: &str = r#"// Linear radiance: the player's colour space is Linear. Maps other than the colour map, and all cubes, are imported with
// sRGB off; the normal map as an ordinary texture, as it is read as stored. Occlusion is the first number of the second
// texture coordinates.
Shader "Skinfit/@TITLE@" {
    Properties {
@PROPERTIES@
    }
    SubShader {
        Tags { "RenderType" = "Opaque" "Queue" = "Geometry" }
        Pass {
            HLSLPROGRAM
            #pragma target 4.5
            #pragma vertex skin_vertex
            #pragma fragment skin_fragment
            #include "UnityCG.cginc"
@BUFFER@
            #include "@INCLUDE@"

            struct OfMesh {
                float4 position : POSITION;
                float3 normal : NORMAL;
                float4 tangent : TANGENT;
                float2 uv : TEXCOORD0;
                float2 occlusion : TEXCOORD1;
            };

            struct Between {
                float4 clip : SV_POSITION;
                float3 position : TEXCOORD0;
                float3 normal : TEXCOORD1;
                float3 tangent : TEXCOORD2;
                float3 bitangent : TEXCOORD3;
                float3 uv : TEXCOORD4;
            };

            // Importers of glTF mirror X; the shader wants glTF's axes.
            float3 turned(float3 v) {
                return float3(-v.x, v.y, v.z);
            }

            Between skin_vertex(OfMesh from) {
                Between to;
                float3 normal = UnityObjectToWorldNormal(from.normal);
                float3 tangent = UnityObjectToWorldDir(from.tangent.xyz);
                // Of Unity's own frame, and turned with it.
                float3 bitangent = cross(normal, tangent) * from.tangent.w * unity_WorldTransformParams.w;
                to.clip = UnityObjectToClipPos(from.position);
                to.position = turned(mul(unity_ObjectToWorld, from.position).xyz);
                to.normal = turned(normal);
                to.tangent = turned(tangent);
                to.bitangent = turned(bitangent);
                to.uv = float3(from.uv, from.occlusion.x);
                return to;
            }

            float4 skin_fragment(Between from) : SV_Target {
                SkinfitSurface at;
@FILLED@
                return skinfit_shade(at);
            }
            ENDHLSL
        }
    }
}
"#;
