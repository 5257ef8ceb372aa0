//! The WGSL of blurs: how a kernel's taps are written, and what they weigh.

use std::fmt::Write as _;

use super::text::{reads, stored};
use super::{Axis, Level, TAPS};
use crate::shader::emit::Plan;
use crate::shader::facts::{Facts, Source};
use crate::shader::module::{sample_struct, uniform};
use crate::shader::quantity::Constant;
use crate::shader::rule::{Kernel, Rule};

/// One direction of a blur, and how it moves: one head, and what differs.
const BLUR: &str = concat!(include_str!("blur_head.wgsl"), include_str!("blur.wgsl"));
const BLUR_TANGENT: &str = concat!(include_str!("blur_head.wgsl"), include_str!("blur_tangent.wgsl"));

/// One direction of a blur.
pub(super) fn blur(plan: &Plan, rule: &Rule, axis: Axis, source: &Level) -> String {
    match plan.facts.source {
        Source::Raster => filled(BLUR, plan, rule, axis, source, (&[], None)),
        Source::Samples | Source::Terms => taps_of(plan, rule, axis, &[], None),
    }
}

/// How a kernel's value moves.
#[derive(Clone, Debug, PartialEq, Eq)]
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
    pub(super) fn call(&self, rule: &Rule, axis: Axis, tap: &str) -> String {
        let mut given = arguments(rule, axis, tap, uniform);
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
pub(super) const TAP: &str = "f32(i)";

/// How a kernel is written in the passes' loops.
pub(super) struct Loop {
    /// Lines before the loop.
    pub(super) before: String,
    /// Taps to either side.
    pub(super) reach: String,
    /// How many texels a tap is read of: two, or one where it lies on a texel.
    pub(super) sides: usize,
    /// Where a tap lies, and what it weighs.
    pub(super) tap: String,
    /// Of a Gaussian how both move as its deviation does.
    pub(super) by_deviation: Option<String>,
}

/// How a constant of that WGSL type stands in the text.
pub(super) type Written = fn(Constant, &str) -> String;

/// The loop of a kernel; `constant` writes what all texels share.
pub(super) fn taps(facts: &Facts, rule: &Rule, axis: Axis, constant: Written) -> Loop {
    let value = || format!("{}({})", rule.function, arguments(rule, axis, TAP, constant).join(", "));
    let kernel = rule.blur.as_ref().map_or(Kernel::Taps(1), |blur| blur.kernel);
    let counted = match kernel {
        Kernel::Taps(taps) => {
            let reach = (taps / 2).to_string();
            return Loop { before: String::new(), reach, sides: 2, tap: value(), by_deviation: None };
        }
        Kernel::Gaussian => facts.setup.choices.diffusion.taps.count(),
        // No loop of these: a texel's two neighbours, or what the processor finds.
        Kernel::Neighbours | Kernel::Surface => Some(1),
    };
    let before = format!("    let deviation: f32 = {};\n", value());
    match counted {
        // A deviation apart.
        Some(taps) => Loop {
            before,
            reach: (taps / 2).to_string(),
            sides: 2,
            tap: "vec2f(f32(i) * deviation, exp(-0.5 * f32(i * i)))".to_owned(),
            by_deviation: Some("vec2f(f32(i), 0.0)".to_owned()),
        },
        // A texel apart, within six deviations.
        None => {
            let steps = "f32(i) / narrow";
            Loop {
                before: before
                    + "    let reach: i32 = i32(min(ceil(6.0 * deviation), f32(max(size.x, size.y))));\n    \
                       let narrow: f32 = max(deviation, 1e-10);\n",
                reach: "reach".to_owned(),
                sides: 1,
                tap: format!("vec2f(f32(i), exp(-0.5 * ({steps}) * ({steps})))"),
                by_deviation: Some(format!("vec2f(0.0, tap.y * ({steps}) * ({steps}) / narrow)")),
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
        values.push(format!("{}({})", rule.function, arguments(rule, axis, &tap, uniform).join(", ")));
        values.extend(slope.map(|slope| slope.call(rule, axis, &tap)));
    }
    wgsl.push_str("\nstruct Taps {\n");
    (0..values.len()).for_each(|i| wgsl.push_str(&format!("    of_{i}: {kind},\n")));
    let _ = writeln!(wgsl, "}}\n\nfn {TAPS}(at: Sample) -> Taps {{");
    wgsl.push_str(&stored(&levels));
    let _ = write!(wgsl, "    return Taps({});\n}}\n", values.join(", "));
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
    let Loop { mut before, reach, sides, tap, by_deviation } = taps(&plan.facts, rule, axis, uniform);
    let moved = slope.map_or_else(String::new, |slope| slope.call(rule, axis, TAP));
    let slope = match by_deviation {
        Some(by_deviation) if slope.is_some() => {
            before += &format!("    let deviation_moves: f32 = {moved};\n");
            format!("deviation_moves * {by_deviation}")
        }
        _ => moved,
    };
    let [staged, own] = lines_of(axis);
    let body = template
        .replace("{staged}", staged)
        .replace("{own}", own)
        .replace("{across}", axis.across().step())
        .replace("{source}", &source.bound())
        .replace("{reads}", &reads(&[&of_kernel(plan, rule)[..], beside].concat(), "here"))
        .replace("{before}", &before)
        .replace("{reach}", &reach)
        .replace("{sides}", &sides.to_string())
        .replace("{kernel}", &tap)
        .replace("{slope}", &slope)
        .replace("{axis}", axis.step());
    format!("{}{body}", plan.declarations(true))
}

/// Which of a workgroup's texels the `k`-th is that it stages, and which is a thread's: how far along, in which line. Neighbours
/// in a row of the atlas are neighbours in memory, whatever the axis.
pub(super) const fn lines_of(axis: Axis) -> [&'static str; 2] {
    match axis {
        Axis::U => ["vec2i(i32(k % STAGED), i32(k / STAGED))", "vec2i(i32(thread % 64u), i32(thread / 64u))"],
        Axis::V => ["vec2i(i32(k / 4u), i32(k % 4u))", "vec2i(i32(thread / 4u), i32(thread % 4u))"],
    }
}

/// The levels that a kernel reads at its texel.
pub(super) fn of_kernel(plan: &Plan, rule: &Rule) -> Vec<Level> {
    let read = |level: &&Level| rule.parameters().iter().any(|(name, _)| *name == level.name);
    plan.levels.iter().filter(read).cloned().collect()
}

/// What a kernel is called with.
pub(super) fn arguments(rule: &Rule, axis: Axis, tap: &str, written: Written) -> Vec<String> {
    let argument = |&(name, kind): &(&'static str, &'static str)| match (name, Constant::from_name(name)) {
        ("tap", _) => tap.to_owned(),
        ("axis", _) => format!("vec2f({})", axis.step()),
        (_, Some(constant)) => written(constant, kind),
        (_, None) => name.to_owned(),
    };
    rule.parameters().iter().map(argument).collect()
}
