//! The text of the shaders that draw what is not skin: the planned vertex stage that places the mesh, and the fragments of
//! `wgsl/plain.wgsl` or, in shadow maps, of `wgsl/casters.wgsl`.

use std::fmt::Write as _;

use super::Show;
use crate::geometry::raster;
use crate::shader::{Facts, Plan, PlanError};

/// Rows of a place before those of the lights.
pub(super) const OWN_ROWS: usize = 5;

/// Rows of four numbers that hold one for each of `lights` lights.
pub(super) const fn rows_of(lights: usize) -> usize {
    lights.div_ceil(4)
}

/// The plan of the vertex stage: where a vertex stands, and what fragments are handed of it. Skin's maps have no part; the view
/// is asked for so that the eye is among the constants.
pub(super) fn placing(facts: &Facts) -> Result<Plan, PlanError> {
    let handed = [("vertex_position", "vec3f"), ("vertex_normal", "vec3f"), ("vertex_uv", "vec2f")];
    vertex_plan(facts, &["clip", "vertex_view"], &handed)
}

/// That of shadow maps: fragments look alpha up.
pub(super) fn casting(facts: &Facts) -> Result<Plan, PlanError> {
    vertex_plan(facts, &["clip"], &[("vertex_uv", "vec2f")])
}

fn vertex_plan(
    facts: &Facts,
    goals: &[&'static str],
    handed: &[(&'static str, &'static str)],
) -> Result<Plan, PlanError> {
    let goals: Vec<&'static str> =
        goals.iter().copied().chain(handed.iter().map(|&(name, _)| name)).collect();
    let plan = Plan::search(&raster(facts), &goals, &[], &[])?;
    Ok(Plan { varyings: handed.to_vec(), ..plan })
}

/// What shines on the parts.
#[derive(Clone, Copy)]
pub(super) struct Shining {
    /// Whether there is an environment.
    pub(super) sky: bool,
    /// How many lights there are.
    pub(super) lights: usize,
}

/// The module for targets that are `hazy` or not, under that light; its entry points are `plain_vertex` and
/// `plain_fragment`. After the plan's attributes the vertex stage reads a factor on the base colour.
pub(super) fn module(plan: &Plan, shining: Shining, show: Show, hazy: bool, multisampled: bool) -> String {
    let Shining { sky, lights } = shining;
    let mut wgsl = vertex_stage(plan, "plain_vertex", "PlainVaryings");
    let _ = write!(
        wgsl,
        "const SKY = {sky};\nconst LIGHTS = {lights}u;\n// Rows of a place, those of the lights after {OWN_ROWS} others.\n\
         const ROWS = {}u;\nconst LIGHT_ROWS = {OWN_ROWS}u;\n\n",
        OWN_ROWS + rows_of(lights),
    );
    wgsl.push_str(include_str!("../wgsl/alpha.wgsl"));
    wgsl.push_str(include_str!("../wgsl/plain.wgsl"));
    wgsl.push_str(&fragment(show, hazy, multisampled));
    wgsl
}

/// The module that draws into shadow maps; its entry points are `cast_vertex` and `cast_fragment`. The vertex stage reads
/// what that of [`module`] does.
pub(super) fn cast_module(plan: &Plan) -> String {
    let mut wgsl = vertex_stage(plan, "cast_vertex", "CastVaryings");
    wgsl.push_str(include_str!("../wgsl/alpha.wgsl"));
    wgsl.push_str(include_str!("../wgsl/casters.wgsl"));
    wgsl
}

/// The vertex stage: a function of that name that returns `varyings`, which hold what the plan hands over, the factor on
/// the base colour, and where in which triangle they are.
fn vertex_stage(plan: &Plan, name: &str, varyings: &str) -> String {
    let mut wgsl = plan.vertex_function("placed");
    let handed: String = plan.varyings.iter().map(|(name, _)| format!("at.{name}, ")).collect();
    let _ = write!(
        wgsl,
        "\n@vertex\nfn {name}(vertex: Vertex, @location({}) tint: vec4f) -> {varyings} {{\n    \
         let at = placed(vertex);\n    let corner = vertex.vertex_index % 3u;\n    \
         let shares = vec2f(f32(corner == 1u), f32(corner == 2u));\n    \
         return {varyings}(at.clip, {handed}tint, shares, vertex.vertex_index / 3u);\n}}\n\n",
        plan.attributes.len(),
    );
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
         let plane = cross(unit_or_zero(dpdx(at.position)), unit_or_zero(dpdy(at.position)));\n    \
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

    fn check(text: &str) {
        let parsed = parse_str(text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
        let checked = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&parsed);
        checked.unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    }

    #[test]
    fn every_module_is_valid() {
        let moves = Facts { morphs: 2, bones: true, ..Facts::default() };
        for facts in [Facts::default(), moves] {
            check(&cast_module(&casting(&facts).unwrap()));
        }
        let plans = [Facts::default(), moves].map(|facts| placing(&facts).unwrap());
        let ways = [(false, false), (true, false), (false, true), (true, true)];
        for (plan, lights) in plans.iter().flat_map(|plan| [0, 1, 5].map(|lights| (plan, lights))) {
            for (show, (hazy, multisampled)) in
                [Show::Lit, Show::Hidden].into_iter().flat_map(|show| ways.map(|way| (show, way)))
            {
                let shining = Shining { sky: lights == 0, lights };
                check(&module(plan, shining, show, hazy, multisampled));
            }
        }
    }
}
