//! The WGSL of passes over the atlas.

use std::fmt::Write as _;

use super::{APART, Axis, Level, TAPS, TEXEL};
use crate::shader::domain::{CHART, Domain, UV};
use crate::shader::emit::Plan;
use crate::shader::facts::{Facts, Source};
use crate::shader::module::{sample_struct, uniform};
use crate::shader::quantity::Constant;
use crate::shader::rule::{Kernel, Rule};

/// The functions by which fragments look levels up.
pub(crate) fn sample_level(facts: &Facts) -> &'static str {
    if facts.dilates() { include_str!("level_dilated.wgsl") } else { include_str!("level.wgsl") }
}

/// One direction of a blur, and how it moves: one head, and what differs.
const BLUR: &str = concat!(include_str!("blur_head.wgsl"), include_str!("blur.wgsl"));
const BLUR_TANGENT: &str = concat!(include_str!("blur_head.wgsl"), include_str!("blur_tangent.wgsl"));
/// How far neighbours lie apart.
const NEIGHBOURS: &str = concat!(include_str!("blur_head.wgsl"), include_str!("neighbours.wgsl"));

/// Empty texels that are filled.
const DILATE: &str = include_str!("dilate.wgsl");

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

/// A texel that holds a value of a level's type; interpolation rounds the chart.
fn texel(level: &Level, value: &str) -> String {
    let chart = format!("round(at.{CHART})");
    match level.kind {
        "f32" => format!("vec4f({value}, 0.0, 0.0, {chart})"),
        "vec2f" => format!("vec4f({value}, 0.0, {chart})"),
        _ => format!("vec4f({value}, {chart})"),
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

/// What fragments look up: which texels count is the same of all levels.
pub(crate) fn sampled(facts: &Facts, levels: &[Level]) -> String {
    let Some(first) = levels.first() else { return String::new() };
    let (before, by) = if facts.dilates() {
        (String::new(), format!("at.{UV}"))
    } else {
        let corners = format!("level_corners({}, at.{UV}, round(at.{CHART}))", first.bound());
        (format!("    let corners = {corners};\n"), "corners".to_owned())
    };
    let read = |level: &Level| {
        let (bound, swizzle, name) = (level.bound(), level.swizzle(), level.quantity());
        format!("    let {name}: {} = level_at({bound}, {by}).{swizzle};\n", level.kind)
    };
    std::iter::once(before).chain(levels.iter().map(read)).collect()
}

/// A level, its empty texels filled.
pub(super) fn dilate(plan: &Plan, source: &Level) -> String {
    format!("{}{}", plan.declarations(true), DILATE.replace("{source}", &source.bound()))
}

/// The lines that read levels' quantities of the fields of a stored sample or texel, `at`.
#[must_use]
pub fn stored(levels: &[Level]) -> String {
    levels.iter().map(|Level { name, kind }| format!("    let {name}: {kind} = at.{name};\n")).collect()
}

/// One direction of a blur.
pub(super) fn blur(plan: &Plan, rule: &Rule, axis: Axis, source: &Level) -> String {
    match plan.facts.source {
        Source::Raster => filled(BLUR, plan, rule, axis, source, (&[], None)),
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
    let template = BLUR_TANGENT.replace("{moved}", &at("near")).replace("{moved_here}", &at("here"));
    let template = format!("{}{template}", slope.functions);
    filled(&template, plan, rule, axis, source, (&slope.levels, Some(slope)))
}

/// A tap in the passes' loops.
const TAP: &str = "f32(i)";

/// How a kernel is written in the passes' loops.
struct Loop {
    /// Lines before the loop.
    before: String,
    /// Taps to either side.
    reach: String,
    /// Where a tap lies, and what it weighs.
    tap: String,
    /// How both move, where they do.
    slope: String,
}

/// The loop of a kernel, `slope` being how its function's value moves.
fn taps(facts: &Facts, rule: &Rule, axis: Axis, slope: Option<&Slope>) -> Loop {
    let value = |tap: &str| format!("{}({})", rule.function, arguments(rule, axis, tap).join(", "));
    let moved = |tap: &str| slope.map_or_else(String::new, |slope| slope.call(rule, axis, tap));
    let kernel = rule.blur.as_ref().map_or(Kernel::Taps(1), |blur| blur.kernel);
    let counted = match kernel {
        Kernel::Taps(taps) => {
            let reach = (taps / 2).to_string();
            return Loop { before: String::new(), reach, tap: value(TAP), slope: moved(TAP) };
        }
        Kernel::Gaussian => facts.setup.choices.diffusion.taps.count(),
        // No loop of these: a texel's two neighbours, or what the processor finds.
        Kernel::Neighbours | Kernel::Surface => Some(1),
    };
    let mut before = format!("    let deviation: f32 = {};\n", value(TAP));
    if slope.is_some() {
        before += &format!("    let deviation_moves: f32 = {};\n", moved(TAP));
    }
    match counted {
        // A deviation apart.
        Some(taps) => Loop {
            before,
            reach: (taps / 2).to_string(),
            tap: "vec2f(f32(i) * deviation, exp(-0.5 * f32(i * i)))".to_owned(),
            slope: "vec2f(f32(i) * deviation_moves, 0.0)".to_owned(),
        },
        // A texel apart, within six deviations.
        None => {
            before += "    let reach = i32(min(ceil(6.0 * deviation), f32(max(size.x, size.y))));\n    \
                       let narrow: f32 = max(deviation, 1e-10);\n";
            let steps = "f32(i) / narrow";
            Loop {
                before,
                reach: "reach".to_owned(),
                tap: format!("vec2f(f32(i), exp(-0.5 * ({steps}) * ({steps})))"),
                slope: format!("vec2f(0.0, tap.y * ({steps}) * ({steps}) * deviation_moves / narrow)"),
            }
        }
    }
}

/// What a kernel is made of, and how it moves, of a stored texel.
fn taps_of(plan: &Plan, rule: &Rule, axis: Axis, beside: &[Level], slope: Option<&Slope>) -> String {
    let levels: Vec<Level> = of_kernel(plan, rule).into_iter().chain(beside.iter().cloned()).collect();
    let fields: Vec<(&str, &str)> = levels.iter().map(|level| (level.name.as_str(), level.kind)).collect();
    let functions = slope.map_or("", |slope| &slope.functions);
    let mut wgsl = format!("{}{functions}{}", plan.declarations(true), sample_struct(&fields));
    let (reach, kind) = match rule.blur.as_ref().map(|blur| blur.kernel) {
        Some(Kernel::Taps(taps)) => ((taps / 2) as i32, "vec2f"),
        _ => (0, "f32"),
    };
    let mut values = Vec::new();
    for tap in -reach..=reach {
        let tap = format!("{tap}.0");
        values.push(format!("{}({})", rule.function, arguments(rule, axis, &tap).join(", ")));
        values.extend(slope.map(|slope| slope.call(rule, axis, &tap)));
    }
    wgsl.push_str("\nstruct Taps {\n");
    (0..values.len()).for_each(|i| wgsl.push_str(&format!("    of_{i}: {kind},\n")));
    let _ = writeln!(wgsl, "}}\n\nfn {TAPS}(at: Sample) -> Taps {{");
    wgsl.push_str(&stored(&levels));
    let _ = write!(wgsl, "    return Taps({});\n}}\n", values.join(", "));
    wgsl
}

/// A pass over neighbours.
pub(super) fn neighbours(plan: &Plan, rule: &Rule, source: &Level) -> String {
    let value = format!("{}({})", rule.function, arguments(rule, Axis::U, TAP).join(", "));
    if plan.facts.source == Source::Raster {
        let leaf = Level { name: rule.gives[0].0.to_owned(), kind: rule.returns };
        let value = texel(&leaf, &value).replace(&format!("round(at.{CHART})"), "middle.w");
        let body = NEIGHBOURS
            .replace("{source}", &source.bound())
            .replace("{reads}", &reads(&of_kernel(plan, rule), "here"))
            .replace("{before}", "")
            .replace("{value}", &value);
        return format!("{}{body}", plan.declarations(true));
    }
    let mut fields: Vec<(String, &str)> =
        of_kernel(plan, rule).iter().map(|level| (level.name.clone(), level.kind)).collect();
    fields.push(("apart".to_owned(), "vec2f"));
    let mut wgsl = format!("{}{}", plan.declarations(true), sample_struct(&fields));
    let _ = writeln!(wgsl, "\nfn {APART}(at: Sample) -> {} {{", rule.returns);
    wgsl.push_str(&stored(&of_kernel(plan, rule)));
    let _ = write!(wgsl, "    let apart: vec2f = at.apart;\n    return {value};\n}}\n");
    wgsl
}

/// The text of one direction of a blur, its markers replaced, after the plan's declarations; `beside` are levels that it
/// reads beside the kernel's.
fn filled(
    template: &str,
    plan: &Plan,
    rule: &Rule,
    axis: Axis,
    source: &Level,
    (beside, slope): (&[Level], Option<&Slope>),
) -> String {
    let Loop { before, reach, tap, slope } = taps(&plan.facts, rule, axis, slope);
    let body = template
        .replace("{source}", &source.bound())
        .replace("{reads}", &reads(&[&of_kernel(plan, rule)[..], beside].concat(), "here"))
        .replace("{before}", &before)
        .replace("{reach}", &reach)
        .replace("{kernel}", &tap)
        .replace("{slope}", &slope)
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
