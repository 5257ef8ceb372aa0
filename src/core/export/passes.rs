//! How an engine makes the levels of the UV atlas that the exported function looks up: which functions it calls, in which
//! order, and into which textures.

use super::function::meaning;
use super::names;
use crate::shader::Plan;
use crate::shader::atlas::{Level, Pass, PassKind, pass_function};
use crate::shader::domain::{ATLAS_UV, UV};

/// The lines that say so; none where nothing is computed in texels.
pub(super) fn wiring(plan: &Plan) -> Vec<String> {
    if plan.passes.is_empty() {
        return Vec::new();
    }
    let size = plan.facts.atlas.unwrap_or_default();
    let mut lines = vec![
        format!("Before the image come passes over the UV atlas, into textures of {size} x {size} texels of four 32-bit floats that"),
        "are black at first: in x, y and z a quantity, in w the chart that a texel lies on, 0 where there is none. They are made".to_owned(),
        "anew when a light, the mesh or a constant has moved, whatever camera looks. `here` is the column and the row that the".to_owned(),
        format!("pass' value is read back at: u = (column + 0.5) / {size}, v = (row + 0.5) / {size}. In this order:"),
    ];
    lines.extend(plan.passes.iter().enumerate().map(|(i, pass)| format!("{}. {}", i + 1, step(pass))));
    let uv = if plan.facts.atlas_uv() == UV { "texture coordinates" } else { ATLAS_UV };
    lines.push(format!("A draw is of the whole mesh, nothing culled, no depth, each vertex at its {uv}: in clip space x = 2 u - 1,"));
    lines.push("and y = 2 v - 1 where y = -1 is row 0 of a texture (OpenGL, Vulkan), y = 1 - 2 v where y = 1 is (Direct3D, Metal,".to_owned());
    lines.push("WebGPU). It takes of the vertices, in world space:".to_owned());
    lines.extend(plan.texel_surface().iter().map(|(name, _)| format!("- {name}: {}", meaning(plan, name))));
    lines.push(String::new());
    lines
}

fn step(pass: &Pass) -> String {
    let into = |level: &Level| {
        format!("{} into {}", names::function(&pass_function(level)), names::function(&level.bound()))
    };
    let left: Vec<String> = pass.leaves.iter().map(into).collect();
    let read: Vec<String> = pass.plan.levels.iter().map(|level| names::function(&level.bound())).collect();
    let of = if read.is_empty() { String::new() } else { format!(", which reads {}", read.join(", ")) };
    let how = match pass.kind {
        PassKind::Draw => "draw the mesh",
        PassKind::Blur(_) | PassKind::Neighbours | PassKind::Surface | PassKind::Dilate => "fill the image",
    };
    format!("{how}: {}{of}", left.join(", "))
}
