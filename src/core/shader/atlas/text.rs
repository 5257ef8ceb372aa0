//! The WGSL of passes over the atlas.

use std::fmt::Write as _;

use super::{Axis, Level, TAPS, TEXEL};
use crate::shader::domain::Domain;
use crate::shader::emit::Plan;
use crate::shader::facts::Source;
use crate::shader::module::{sample_struct, uniform};
use crate::shader::quantity::Constant;
use crate::shader::rule::Rule;

/// The function by which fragments look levels up.
pub(crate) const SAMPLE_LEVEL: &str = include_str!("level.wgsl");

/// One direction of a blur, and how it moves: one head, and what differs.
const BLUR: &str = concat!(include_str!("blur_head.wgsl"), include_str!("blur.wgsl"));
const BLUR_TANGENT: &str = concat!(include_str!("blur_head.wgsl"), include_str!("blur_tangent.wgsl"));

/// Where the mesh lies in the atlas: v runs downwards.
const IN_ATLAS: &str = "vec4f(2.0 * vertex_uv.x - 1.0, 1.0 - 2.0 * vertex_uv.y, 0.0, 1.0)";

/// A draw of the mesh into the atlas.
pub(super) fn draw(plan: &Plan, leaves: &[Level]) -> String {
    let targets: Vec<(Level, String)> =
        leaves.iter().map(|level| (level.clone(), level.name.clone())).collect();
    draw_of(plan, "", "", &targets)
}

/// A draw of the mesh into levels, each with its value; `functions` and `lines` follow the plan's own.
pub(super) fn draw_of(plan: &Plan, functions: &str, lines: &str, targets: &[(Level, String)]) -> String {
    if plan.facts.source != Source::Raster {
        return texel_of(plan, functions, lines, targets);
    }
    let mut wgsl = plan.vertex_module_at("", IN_ATLAS);
    wgsl.push_str(functions);
    wgsl.push_str("\nstruct Texel {\n");
    for (i, (level, _)) in targets.iter().enumerate() {
        let _ = writeln!(wgsl, "    @location({i}) {}: vec4f,", level.name);
    }
    wgsl.push_str("}\n\n@fragment\nfn fs_main(at: Varyings) -> Texel {\n");
    wgsl.push_str(&reads(&plan.levels, "vec2i(at.clip.xy)"));
    wgsl.push_str(&plan.calls(Domain::Texel, uniform, |name| format!("at.{name}")));
    wgsl.push_str(lines);
    let values: Vec<String> = targets.iter().map(|(level, value)| texel(level, value)).collect();
    let _ = write!(wgsl, "    return Texel({});\n}}\n", values.join(", "));
    wgsl
}

/// The same of a stored texel.
fn texel_of(plan: &Plan, functions: &str, lines: &str, targets: &[(Level, String)]) -> String {
    let varyings = plan.varyings.iter().map(|&(name, kind)| (name.to_owned(), kind));
    let levels = plan.levels.iter().map(|level| (level.name.clone(), level.kind));
    let fields: Vec<(String, &str)> = varyings.chain(levels).collect();
    let mut wgsl = format!("{}{functions}{}", plan.declarations(true), sample_struct(&fields));
    wgsl.push_str("\nstruct Texel {\n");
    for (level, _) in targets {
        let _ = writeln!(wgsl, "    {}: {},", level.name, level.kind);
    }
    let _ = writeln!(wgsl, "}}\n\nfn {TEXEL}(at: Sample) -> Texel {{");
    wgsl.push_str(&stored(&plan.levels));
    wgsl.push_str(&plan.calls(Domain::Texel, uniform, |name| format!("at.{name}")));
    wgsl.push_str(lines);
    let values: Vec<&str> = targets.iter().map(|(_, value)| value.as_str()).collect();
    let _ = write!(wgsl, "    return Texel({});\n}}\n", values.join(", "));
    wgsl
}

/// A texel that holds a value of a level's type.
fn texel(level: &Level, value: &str) -> String {
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

/// The lines that read levels' quantities of the fields of a stored sample or texel, `at`.
#[must_use]
pub fn stored(levels: &[Level]) -> String {
    levels.iter().map(|Level { name, kind }| format!("    let {name}: {kind} = at.{name};\n")).collect()
}

/// One direction of a blur.
pub(super) fn blur(plan: &Plan, rule: &Rule, axis: Axis, source: &Level) -> String {
    match plan.facts.source {
        Source::Raster => filled(BLUR, plan, rule, axis, source, &[]),
        Source::Samples | Source::Terms => taps_of(plan, rule, axis, &[], None),
    }
}

/// How a kernel's value moves.
pub(super) struct Slope {
    /// The tangent's name.
    pub(super) name: String,
    /// What it is called with after the kernel's own arguments.
    pub(super) along: Vec<String>,
    /// The functions that it takes.
    pub(super) functions: String,
    /// The levels that it reads beside the kernel's.
    pub(super) levels: Vec<Level>,
}

impl Slope {
    fn call(&self, rule: &Rule, axis: Axis, tap: &str) -> String {
        let mut given = arguments(rule, axis, tap);
        given.extend(self.along.iter().cloned());
        format!("{}({})", self.name, given.join(", "))
    }
}

/// How one direction of a blur moves, where its kernel does; `moved` holds how what is blurred moves.
pub(super) fn blur_tangent(
    plan: &Plan,
    rule: &Rule,
    axis: Axis,
    (source, moved): (&Level, Option<&Level>),
    slope: &Slope,
) -> String {
    if plan.facts.source != Source::Raster {
        return taps_of(plan, rule, axis, &slope.levels, Some(slope));
    }
    let of = |level: &Level, place: &str| format!("textureLoad({}, {place}, 0).xyz", level.bound());
    let at = |place: &str| moved.map_or("vec3f(0.0)".to_owned(), |level| of(level, place));
    let template = BLUR_TANGENT
        .replace("{slope}", &slope.call(rule, axis, TAP))
        .replace("{moved}", &at("near"))
        .replace("{moved_here}", &at("here"));
    filled(&format!("{}{template}", slope.functions), plan, rule, axis, source, &slope.levels)
}

/// A tap in the passes' loops.
const TAP: &str = "f32(i)";

/// The taps of one direction, and how they move, of a stored texel.
fn taps_of(plan: &Plan, rule: &Rule, axis: Axis, beside: &[Level], slope: Option<&Slope>) -> String {
    let levels: Vec<Level> = of_kernel(plan, rule).into_iter().chain(beside.iter().cloned()).collect();
    let fields: Vec<(&str, &str)> = levels.iter().map(|level| (level.name.as_str(), level.kind)).collect();
    let functions = slope.map_or("", |slope| &slope.functions);
    let mut wgsl = format!("{}{functions}{}", plan.declarations(true), sample_struct(&fields));
    let reach = rule.blur.as_ref().map_or(0, |blur| blur.taps / 2) as i32;
    let mut values = Vec::new();
    for tap in -reach..=reach {
        let tap = format!("{tap}.0");
        values.push(format!("{}({})", rule.function, arguments(rule, axis, &tap).join(", ")));
        values.extend(slope.map(|slope| slope.call(rule, axis, &tap)));
    }
    wgsl.push_str("\nstruct Taps {\n");
    (0..values.len()).for_each(|i| wgsl.push_str(&format!("    of_{i}: vec2f,\n")));
    let _ = writeln!(wgsl, "}}\n\nfn {TAPS}(at: Sample) -> Taps {{");
    wgsl.push_str(&stored(&levels));
    let _ = write!(wgsl, "    return Taps({});\n}}\n", values.join(", "));
    wgsl
}

/// The text of one direction of a blur, its markers replaced, after the plan's declarations; `beside` are levels that it
/// reads beside the kernel's.
fn filled(template: &str, plan: &Plan, rule: &Rule, axis: Axis, source: &Level, beside: &[Level]) -> String {
    let reach = rule.blur.as_ref().map_or(0, |blur| blur.taps / 2);
    let kernel = format!("{}({})", rule.function, arguments(rule, axis, TAP).join(", "));
    let body = template
        .replace("{source}", &source.bound())
        .replace("{reads}", &reads(&[&of_kernel(plan, rule)[..], beside].concat(), "here"))
        .replace("{reach}", &reach.to_string())
        .replace("{kernel}", &kernel)
        .replace("{axis}", axis.step());
    format!("{}{body}", plan.declarations(true))
}

/// The levels that a kernel reads at its texel.
fn of_kernel(plan: &Plan, rule: &Rule) -> Vec<Level> {
    let read = |level: &&Level| rule.parameters().iter().any(|(name, _)| *name == level.name);
    plan.levels.iter().filter(read).cloned().collect()
}

/// What a kernel is called with.
fn arguments(rule: &Rule, axis: Axis, tap: &str) -> Vec<String> {
    let argument = |&(name, kind): &(&'static str, &'static str)| match (name, Constant::from_name(name)) {
        ("tap", _) => tap.to_owned(),
        ("axis", _) => format!("vec2f({})", axis.step()),
        (_, Some(constant)) => uniform(constant, kind),
        (_, None) => name.to_owned(),
    };
    rule.parameters().iter().map(argument).collect()
}
