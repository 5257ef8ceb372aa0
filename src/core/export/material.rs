//! Materials of engines that use an exported shader: they fill what it is called with, and name the cubes and maps that it
//! reads.

use super::function::{meaning, planned, what_to_bind};
use super::{ExportError, Target, names};
use crate::model::params::Params;
use crate::shader::quantity::Kind;
use crate::shader::{Facts, Plan, Resource};

/// The engines that there are materials for.
const ENGINES: [Target; 2] = [Target::Godot, Target::Unity];

/// A material for the shader that [`super::function`] makes of the same facts and constants; `shader` is the name that its
/// file has for the engine.
///
/// # Errors
/// When the target is no engine, or the shader asks for what a material cannot hand over; as of [`super::function`].
pub fn material(target: Target, facts: &Facts, params: &Params, shader: &str) -> Result<String, ExportError> {
    let engines = || ENGINES.map(Target::name).join(" or ");
    if !ENGINES.contains(&target) {
        return Err(ExportError::NoMaterial { target: target.name(), engines: engines() });
    }
    let (plan, resources, _) = planned(facts, params)?;
    if !plan.passes.is_empty() {
        return Err(ExportError::Unfilled { what: "textures that passes over the UV atlas make".to_owned() });
    }
    let parts = Parts { plan: &plan, resources: &resources, params, shader };
    match target {
        Target::Unity => parts.unity(),
        _ => parts.godot(),
    }
}

/// What a material is made of.
struct Parts<'a> {
    plan: &'a Plan,
    resources: &'a [Resource],
    params: &'a Params,
    shader: &'a str,
}

/// What an engine has of each member of the surface, in glTF's axes.
type Members = [(&'static str, &'static str); 7];

/// Godot's axes are glTF's (docs/engines.md).
const GODOT: Members = [
    ("vertex_position", "skin_position"),
    ("vertex_normal", "skin_normal"),
    ("vertex_tangent", "skin_tangent"),
    ("vertex_bitangent", "skin_bitangent"),
    ("vertex_uv", "UV"),
    ("vertex_occlusion", "UV2.x"),
    ("eye", "CAMERA_POSITION_WORLD"),
];

/// Unity's X is glTF's, mirrored; the vertex stage has turned it back.
const UNITY: Members = [
    ("vertex_position", "from.position"),
    ("vertex_normal", "from.normal"),
    ("vertex_tangent", "from.tangent"),
    ("vertex_bitangent", "from.bitangent"),
    ("vertex_uv", "from.uv.xy"),
    ("vertex_occlusion", "from.uv.z"),
    ("eye", "turned(_WorldSpaceCameraPos)"),
];

impl Parts<'_> {
    /// A line for each member of the surface.
    fn filled(&self, members: &Members, indent: &str) -> Result<String, ExportError> {
        let line = |(name, _): &(&'static str, &'static str)| {
            let known = members.iter().find(|(member, _)| member == name);
            let Some((_, value)) = known else {
                return Err(ExportError::Unfilled { what: format!("{name} ({})", meaning(self.plan, name)) });
            };
            Ok(format!("{indent}at.{name} = {value};\n"))
        };
        self.plan.surface().iter().map(line).collect()
    }

    /// The cubes and maps: their names, whether they are cubes, and what belongs there.
    fn bound(&self) -> impl Iterator<Item = (String, bool, String)> {
        let bound = |resource: &Resource| {
            let words = what_to_bind(*resource, self.params)?;
            Some((names::function(resource.name()), resource.kind() == Kind::Cube, words))
        };
        self.resources.iter().filter_map(bound)
    }

    /// A ShaderLab file (Unity's manual, "ShaderLab"): unlit, for the built-in pipeline and URP.
    fn unity(&self) -> Result<String, ExportError> {
        let property = |(name, cube, words): (String, bool, String)| {
            let (kind, neutral) = if cube { ("Cube", "black") } else { ("2D", "white") };
            let words = words.replace('"', "'");
            format!("        [NoScaleOffset] {name} (\"{words}\", {kind}) = \"{neutral}\" {{}}\n")
        };
        let properties: String = self.bound().map(property).collect();
        let filled = self.filled(&UNITY, "                ")?;
        Ok(UNITY_SHADER
            .replace("PROPERTIES\n", &properties)
            .replace("FILLED\n", &filled)
            .replace("SHADER", &self.shader.replace('"', "")))
    }

    /// A material resource with its shader within (Godot's documentation, "TSCN file format", which .tres shares).
    fn godot(&self) -> Result<String, ExportError> {
        let code = GODOT_SHADER
            .replace("FILLED\n", &self.filled(&GODOT, "    ")?)
            .replace("SHADER", &self.shader.replace('"', ""));
        let code = code.replace('\\', "\\\\").replace('"', "\\\"");
        let (mut files, mut values) = (String::new(), String::new());
        for (i, (name, cube, words)) in self.bound().enumerate() {
            let (kind, ending) = if cube { ("Cubemap", "dds") } else { ("Texture2D", "png") };
            let file =
                name.trim_start_matches(names::PREFIX).trim_end_matches("_cube").trim_end_matches("_map");
            let path = format!("res://{file}.{ending}");
            files += &format!("; {words}\n[ext_resource type=\"{kind}\" path=\"{path}\" id=\"{i}\"]\n");
            values += &format!("shader_parameter/{name} = ExtResource(\"{i}\")\n");
        }
        Ok(format!(
            "[gd_resource type=\"ShaderMaterial\" format=3]\n\n; Give each path as the project has it. Occlusion is the \
             first number of the second texture coordinates.\n{files}\n[sub_resource type=\"Shader\" id=\"skin\"]\n\
             code = \"{code}\"\n\n[resource]\nshader = SubResource(\"skin\")\n{values}"
        ))
    }
}

const GODOT_SHADER: &str = r#"shader_type spatial;
render_mode unshaded;

#include "SHADER"

varying vec3 skin_position;
varying vec3 skin_normal;
varying vec3 skin_tangent;
varying vec3 skin_bitangent;

void vertex() {
    skin_position = (MODEL_MATRIX * vec4(VERTEX, 1.0)).xyz;
    skin_normal = normalize(MODEL_NORMAL_MATRIX * NORMAL);
    skin_tangent = normalize(mat3(MODEL_MATRIX) * TANGENT);
    skin_bitangent = normalize(mat3(MODEL_MATRIX) * BINORMAL);
}

void fragment() {
    SkinfitSurface at;
FILLED
    ALBEDO = skinfit_shade(at).rgb;
}
"#;

const UNITY_SHADER: &str = r#"// Linear radiance: the player's colour space is Linear. Maps other than the colour map, and all cubes, are imported with
// sRGB off; the normal map as an ordinary texture, as it is read as stored. Occlusion is the first number of the second
// texture coordinates.
Shader "Skinfit/Skin" {
    Properties {
PROPERTIES
    }
    SubShader {
        Tags { "RenderType" = "Opaque" "Queue" = "Geometry" }
        Pass {
            HLSLPROGRAM
            #pragma target 4.5
            #pragma vertex skin_vertex
            #pragma fragment skin_fragment
            #include "UnityCG.cginc"
            #include "SHADER"

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
FILLED
                return skinfit_shade(at);
            }
            ENDHLSL
        }
    }
}
"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{BUDGET, Provenance, function};
    use crate::model::effects::{Effects, Form, Silhouette};
    use crate::model::evaluate::Setup;
    use crate::shader::facts::MapFacts;

    /// All maps, each by itself, on a mesh of which nothing is known.
    fn facts(setup: Setup) -> Facts {
        let maps =
            MapFacts { color: true, normal: true, specular: true, attenuator: true, ..MapFacts::default() };
        Facts { setup, maps, budget: BUDGET, tessellation: 1.0, ..Facts::default() }
    }

    fn surface() -> Facts {
        facts(Setup::new(Form::Corrected, Silhouette::Fragment, Effects::SURFACE))
    }

    /// The words of a text that begin with the prefix.
    fn words(text: &str) -> Vec<&str> {
        let word = |c: char| !(c.is_ascii_alphanumeric() || c == '_');
        text.split(word).filter(|word| word.starts_with(names::PREFIX)).collect()
    }

    #[test]
    fn a_material_fills_every_member_and_names_what_the_shader_declares() {
        let (facts, params) = (surface(), Params::defaults(Form::Corrected));
        let (plan, ..) = planned(&facts, &params).unwrap();
        for target in ENGINES {
            let shader = function(target, &facts, &params, &Provenance::default()).unwrap();
            let material = material(target, &facts, &params, "skin.inc").unwrap();
            assert!(
                material.contains("skin.inc") && !material.contains("SHADER") && !material.contains("FILLED")
            );
            for (member, _) in plan.surface() {
                assert_eq!(material.matches(&format!("at.{member} = ")).count(), 1, "{member}: {material}");
            }
            for word in words(&material).into_iter().filter(|word| *word != "skinfit_shade") {
                assert!(shader.contains(&format!(" {word}")), "{word} is not the shader's");
            }
            for bound in ["skinfit_irradiance_cube", "skinfit_hilite_cube", "skinfit_color_map"] {
                assert!(material.contains(bound), "{material}");
            }
            let count = |c: char| material.matches(c).count();
            assert_eq!((count('{'), count('(')), (count('}'), count(')')), "{material}");
        }
    }

    #[test]
    fn what_no_material_can_hand_over_is_refused() {
        let params = Params::defaults(Form::Corrected);
        let error = material(Target::C, &surface(), &params, "skin.h").unwrap_err().to_string();
        assert!(error.starts_with("c is no engine") && error.contains("godot or unity"), "{error}");
        // The listing's rim is made at vertices.
        let setup = Setup::new(Form::Listing, Silhouette::Vertex, Effects::SURFACE);
        let listing = Facts { square_rim: true, ..facts(Setup { interpolated_rim: true, ..setup }) };
        let params = Params::defaults(Form::Listing);
        let error = material(Target::Unity, &listing, &params, "skin.hlsl").unwrap_err().to_string();
        assert!(error.contains("vertex_") && error.contains("which no material file hands over"), "{error}");
    }
}
