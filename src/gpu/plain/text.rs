//! The text of the shaders that draw what is not skin: the planned vertex stage that places the mesh, what reaches its
//! vertices, and the fragments of `wgsl/plain.wgsl`.

use std::fmt::Write as _;

use super::Show;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::geometry::raster;
use crate::shader::{Facts, Plan, PlanError};

/// Rows of a vertex before those of the lights.
pub(super) const OWN_ROWS: usize = 4;
/// Varyings beside those of the lights.
const OWN_VARYINGS: u32 = 8;

/// What fragments are handed of the lights.
pub(super) struct Varyings {
    lights: usize,
}

impl Varyings {
    /// Of so many lights.
    ///
    /// # Errors
    /// When the adapter hands over fewer numbers.
    pub(super) fn new(gpu: &Gpu, lights: usize) -> Result<Self, GpuError> {
        let most = 4 * gpu.device.limits().max_inter_stage_shader_variables.saturating_sub(OWN_VARYINGS);
        if lights <= most as usize {
            return Ok(Self { lights });
        }
        let what = format!(
            "{lights} lights shine on parts that are not skin, and the adapter draws these under {most}"
        );
        Err(GpuError::CpuAlone { what })
    }

    /// Rows of four lights.
    fn rows(&self) -> usize {
        rows_of(self.lights)
    }
}

/// Rows of four numbers for so many.
pub(super) const fn rows_of(lights: usize) -> usize {
    lights.div_ceil(4)
}

/// The plan of the vertex stage: where a vertex stands, and what fragments are handed of it. Skin's maps have no part; the view
/// is asked for so that the eye is among the constants.
pub(super) fn placing(facts: &Facts) -> Result<Plan, PlanError> {
    let handed = [("vertex_position", "vec3f"), ("vertex_normal", "vec3f"), ("vertex_uv", "vec2f")];
    let goals: Vec<&'static str> =
        ["clip", "vertex_view"].into_iter().chain(handed.map(|(name, _)| name)).collect();
    let plan = Plan::search(&raster(facts), &goals, &[], &[])?;
    Ok(Plan { varyings: handed.to_vec(), ..plan })
}

/// The module for targets that are `hazy` or not; its entry points are `plain_vertex` and `plain_fragment`.
pub(super) fn module(plan: &Plan, varyings: &Varyings, show: Show, hazy: bool, multisampled: bool) -> String {
    let mut wgsl = plan.vertex_function("placed");
    let rows = varyings.rows();
    wgsl.push_str(
        "\nstruct PlainVaryings {\n    @invariant @builtin(position) clip: vec4f,\n    @location(0) place: vec3f,\n    \
         @location(1) normal: vec3f,\n    @location(2) uv: vec2f,\n    @location(3) tint: vec4f,\n    \
         @location(4) blocked_first: vec4f,\n    @location(5) blocked_second: vec4f,\n    \
         @location(6) blocked_last: f32,\n    @location(7) @interpolate(flat) first: u32,\n",
    );
    for row in 0..rows {
        let _ = writeln!(wgsl, "    @location({}) arriving{row}: vec4f,", OWN_VARYINGS as usize + row);
    }
    let arriving: String = (0..rows).map(|row| format!(", rows[row + {}u]", OWN_ROWS + row)).collect();
    let _ = write!(
        wgsl,
        "}}\n\n@vertex\nfn plain_vertex(vertex: Vertex) -> PlainVaryings {{\n    let at = placed(vertex);\n    \
         let row = {}u * (vertex.vertex_index - drawn.first_vertex);\n    return PlainVaryings(at.clip, at.vertex_position, at.vertex_normal, \
         at.vertex_uv, rows[row + 3u], rows[row], rows[row + 1u], rows[row + 2u].x, vertex.vertex_index{arriving});\n}}\n",
        OWN_ROWS + rows
    );
    // WGSL knows no empty arrays.
    let handed: Vec<String> = match rows {
        0 => vec!["vec4f(0.0)".to_owned()],
        _ => (0..rows).map(|row| format!("at.arriving{row}")).collect(),
    };
    let _ = write!(
        wgsl,
        "\nconst LIGHTS = {}u;\n\nfn arriving_of(at: PlainVaryings) -> array<vec4f, {}> {{\n    return array({});\n}}\n\n",
        varyings.lights,
        handed.len(),
        handed.join(", ")
    );
    wgsl.push_str(include_str!("../wgsl/plain.wgsl"));
    wgsl.push_str(&fragment(show, hazy, multisampled));
    wgsl
}

/// The fragment stage's entry point, and what it returns: colour with coverage as its alpha, or with no haze there and
/// coverage beside it.
fn fragment(show: Show, hazy: bool, multisampled: bool) -> String {
    let mut wgsl = String::from("\nstruct PlainFragment {\n    @location(0) color: vec4f,\n");
    if hazy {
        wgsl.push_str("    @location(1) coverage: f32,\n");
    }
    if multisampled {
        wgsl.push_str("    @builtin(sample_mask) mask: u32,\n");
    }
    let color = match (show, hazy) {
        (Show::Lit, false) => "vec4f(radiance(at, plane), 1.0)",
        (Show::Lit, true) => "vec4f(radiance(at, plane), 0.0), 1.0",
        (Show::Hidden, false) => "vec4f(0.0)",
        (Show::Hidden, true) => "vec4f(0.0), 0.0",
    };
    let mask = if multisampled { ", mask" } else { "" };
    let _ = write!(
        wgsl,
        "}}\n\n@fragment\nfn plain_fragment(at: PlainVaryings) -> PlainFragment {{\n    \
         let plane = cross(unit_or_zero(dpdx(at.place)), unit_or_zero(dpdy(at.place)));\n    \
         let mask = samples_shown(at);\n    if (mask == 0u) {{\n        discard;\n    }}\n    \
         return PlainFragment({color}{mask});\n}}\n"
    );
    wgsl
}

#[cfg(test)]
mod tests {
    use naga::front::wgsl::parse_str;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;

    #[test]
    fn every_module_is_valid() {
        let plan = placing(&Facts::default()).unwrap();
        let ways = [(false, false), (true, false), (false, true), (true, true)];
        for (lights, show) in
            [0, 1, 5].into_iter().flat_map(|lights| [(lights, Show::Lit), (lights, Show::Hidden)])
        {
            for (hazy, multisampled) in ways {
                let text = module(&plan, &Varyings { lights }, show, hazy, multisampled);
                let parsed =
                    parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
                let checked = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&parsed);
                checked.unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
            }
        }
    }
}
