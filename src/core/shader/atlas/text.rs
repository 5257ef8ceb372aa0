//! The WGSL of passes over the atlas.

use std::fmt::Write as _;

use super::{Axis, Level};
use crate::shader::domain::Domain;
use crate::shader::emit::Plan;
use crate::shader::module::uniform;
use crate::shader::quantity::Constant;
use crate::shader::rule::Rule;

/// The function by which fragments look levels up.
pub(crate) const SAMPLE_LEVEL: &str = include_str!("level.wgsl");

/// Where the mesh lies in the atlas: v runs downwards.
const IN_ATLAS: &str = "vec4f(2.0 * vertex_uv.x - 1.0, 1.0 - 2.0 * vertex_uv.y, 0.0, 1.0)";

/// A draw of the mesh into the atlas.
pub(super) fn draw(plan: &Plan, leaves: &[Level]) -> String {
    let targets: Vec<(String, String)> =
        leaves.iter().map(|level| (level.name.clone(), texel(level, &level.name))).collect();
    draw_of(plan, "", "", &targets)
}

/// A draw of the mesh into targets, each a name and a `vec4f`; `functions` and `lines` follow the plan's own.
pub(super) fn draw_of(plan: &Plan, functions: &str, lines: &str, targets: &[(String, String)]) -> String {
    let mut wgsl = plan.vertex_module_at("", IN_ATLAS);
    wgsl.push_str(functions);
    wgsl.push_str("\nstruct Texel {\n");
    for (i, (name, _)) in targets.iter().enumerate() {
        let _ = writeln!(wgsl, "    @location({i}) {name}: vec4f,");
    }
    wgsl.push_str("}\n\n@fragment\nfn fs_main(at: Varyings) -> Texel {\n");
    wgsl.push_str(&reads(&plan.levels, "vec2i(at.clip.xy)"));
    wgsl.push_str(&plan.calls(Domain::Texel, uniform, |name| format!("at.{name}")));
    wgsl.push_str(lines);
    let values: Vec<&str> = targets.iter().map(|(_, value)| value.as_str()).collect();
    let _ = write!(wgsl, "    return Texel({});\n}}\n", values.join(", "));
    wgsl
}

/// A texel that holds a value of a level's type.
pub(super) fn texel(level: &Level, value: &str) -> String {
    match level.kind {
        "f32" => format!("vec4f({value}, 0.0, 0.0, 1.0)"),
        "vec2f" => format!("vec4f({value}, 0.0, 1.0)"),
        _ => format!("vec4f({value}, 1.0)"),
    }
}

/// Levels' quantities at a texel.
fn reads(levels: &[Level], place: &str) -> String {
    let read = |level: &Level| {
        let (bound, swizzle) = (level.bound(), level.swizzle());
        format!("    let {}: {} = textureLoad({bound}, {place}, 0).{swizzle};\n", level.name, level.kind)
    };
    levels.iter().map(read).collect()
}

/// What fragments look up.
pub(crate) fn sampled(levels: &[Level]) -> String {
    let read = |level: &Level| {
        let (bound, swizzle) = (level.bound(), level.swizzle());
        format!("    let {}: {} = sample_level({bound}, at.vertex_uv).{swizzle};\n", level.name, level.kind)
    };
    levels.iter().map(read).collect()
}

/// One direction of a blur.
pub(super) fn blur(plan: &Plan, rule: &Rule, axis: Axis, source: &Level) -> String {
    filled(include_str!("blur.wgsl"), plan, rule, axis, source)
}

/// The text of one direction of a blur, its markers replaced, after the plan's declarations.
pub(super) fn filled(template: &str, plan: &Plan, rule: &Rule, axis: Axis, source: &Level) -> String {
    let axis = axis.step();
    let reach = rule.blur.as_ref().map_or(0, |blur| blur.taps / 2);
    let kernel = format!("{}({})", rule.function, arguments(rule, axis).join(", "));
    let body = template
        .replace("{source}", &source.bound())
        .replace("{reads}", &reads(&of_kernel(plan, rule), "here"))
        .replace("{reach}", &reach.to_string())
        .replace("{kernel}", &kernel)
        .replace("{axis}", axis);
    format!("{}{body}", plan.declarations(true))
}

/// The levels that a kernel reads at its texel.
fn of_kernel(plan: &Plan, rule: &Rule) -> Vec<Level> {
    let read = |level: &&Level| rule.parameters().iter().any(|(name, _)| *name == level.name);
    plan.levels.iter().filter(read).cloned().collect()
}

/// What a kernel is called with.
pub(super) fn arguments(rule: &Rule, axis: &str) -> Vec<String> {
    let argument = |&(name, kind): &(&'static str, &'static str)| match (name, Constant::from_name(name)) {
        ("tap", _) => "f32(i)".to_owned(),
        ("axis", _) => format!("vec2f({axis})"),
        (_, Some(constant)) => uniform(constant, kind),
        (_, None) => name.to_owned(),
    };
    rule.parameters().iter().map(argument).collect()
}
