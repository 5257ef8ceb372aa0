//! A material of Godot: a resource file with a shader within.

use super::{Bound, Members, Parts};
use crate::export::ExportError;

/// Godot's axes are glTF's (docs/engines.md).
const MEMBERS: Members = [
    ("vertex_position", "skin_position"),
    ("vertex_normal", "skin_normal"),
    ("vertex_tangent", "skin_tangent"),
    ("vertex_bitangent", "skin_bitangent"),
    ("vertex_uv", "UV"),
    ("vertex_occlusion", "UV2.x"),
    ("eye", "CAMERA_POSITION_WORLD"),
];

/// A material resource with its shader within (Godot's documentation, "TSCN file format", which .tres shares).
pub(super) fn text(parts: &Parts<'_>) -> Result<String, ExportError> {
    let code = SHADER
        .replace("FILLED\n", &parts.filled(&MEMBERS, "    ")?)
        .replace("SHADER", &parts.shader.replace('"', ""));
    let code = code.replace('\\', "\\\\").replace('"', "\\\"");
    let (mut files, mut values) = (String::new(), String::new());
    for (i, bound) in parts.bound().enumerate() {
        let (kind, ending) = if bound.cube { ("Cubemap", "dds") } else { ("Texture2D", "png") };
        let path = format!("res://{}.{ending}", bound.short());
        let Bound { name, words, .. } = bound;
        files += &format!("; {words}\n[ext_resource type=\"{kind}\" path=\"{path}\" id=\"{i}\"]\n");
        values += &format!("shader_parameter/{name} = ExtResource(\"{i}\")\n");
    }
    Ok(format!(
        "[gd_resource type=\"ShaderMaterial\" format=3]\n\n; For the renderers Forward+ and Mobile: in Compatibility, \
         shaders work in sRGB.\n; Give each path as the project has it. Occlusion is the first number of the second \
         texture coordinates.\n{files}\n[sub_resource type=\"Shader\" id=\"skin\"]\n\
         code = \"{code}\"\n\n[resource]\nshader = SubResource(\"skin\")\n{values}"
    ))
}

const SHADER: &str = r#"shader_type spatial;
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
