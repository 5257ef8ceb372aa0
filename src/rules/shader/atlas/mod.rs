//! Passes over the UV atlas: texels' quantities, and blurs of them, in the order in which they are made.
//!
//! A *level* is a texture of the atlas' size, four 32-bit floats a texel: a quantity, and in w the texel's chart, counted
//! from 1, 0 where the mesh has no surface. A *draw* evaluates the rules of texels in each that the mesh covers, and
//! leaves the levels that a pass or a fragment reads. A *blur* reads a level and leaves another, along u
//! or along v. Draws and blurs take turns where texels' rules need what was blurred; a later draw reads the levels of those
//! before, and computes anew what stands in none.
//!
//! Beside stored samples stand stored texels: the same passes are functions of them ([`TEXEL`], [`TAPS`]), which the
//! processor evaluates.
//!
//! - this module: from the rules that a search has found to passes; `order`: which come before which; `level`: what
//!   they leave
//! - `text`: their WGSL; `kernel`: that of blurs; `function`: the same as functions for another engine
//! - [`tangent`]: passes that leave how levels move; [`named`]: these beside the plan's
//! - [`buffers`]: passes over stored texels as compute shaders, for the engine on an adapter (`layers`: where levels stand;
//!   `columns`: what moves beside what is blurred); [`adjoint`]: the same backwards

pub mod adjoint;
pub mod buffers;
mod columns;
mod function;
mod kernel;
mod layers;
mod level;
pub mod named;
mod order;
pub mod tangent;
#[cfg(test)]
mod tests;
pub(super) mod text;

pub use self::function::pass_function;
pub use self::level::{Axis, Level};
pub(super) use self::order::with_vertices;
use self::order::{depths, in_levels, upstream};
pub use self::text::{sample_buffered_level, stored};
use super::domain::{CHART, DIRECTIONS, Domain, TAP_COST};
use super::emit::Plan;
use super::facts::{Facts, Source};
use super::rule::{Kernel, Rule};
use super::search::{Carried, Found, PlanError};
use crate::model::diffusion::Seams;

/// Levels that a draw leaves: as many textures as an adapter writes into at once, by WebGPU's defaults.
const LEVELS_A_DRAW: usize = 4;

/// Texels that a workgroup of a blur takes, along its axis and across; that of another pass takes [`TEXELS`] of the list.
pub const TILE: [u32; 2] = [64, 4];
/// Threads of a workgroup that takes texels one by one.
pub const TEXELS: u32 = 64;

/// How a pass is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassKind {
    /// The rules of texels, of what the mesh's vertices hand over.
    Draw,
    /// A blur along an axis.
    Blur(Axis),
    /// How far what is read lies from one neighbour to the next.
    Neighbours,
    /// The processor alone sums up over the surface.
    Surface,
    /// What is read, its empty texels filled two rings deep.
    Dilate,
}

/// A pass over the atlas.
#[derive(Clone, Debug)]
pub struct Pass {
    /// How it is drawn.
    pub kind: PassKind,
    /// What it leaves: of the texels that the mesh covers (and of those that it fills); others stay 0.
    pub leaves: Vec<Level>,
    /// Its rules, and what they read; of a blur the first level is what is blurred. The module's entry points are
    /// `cs_texels` and of a draw before it `cs_vertices`, over stored texels [`TEXEL`] or [`TAPS`].
    pub plan: Plan,
    /// Of a blur that leaves how another moves, and whose kernel moves itself.
    pub moving: Option<MovingKernel>,
}

/// A kernel that moves along a seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovingKernel {
    /// The level that holds how what is blurred moves; `None` where it stays.
    pub blurred: Option<Level>,
    /// How the kernel's value does.
    slope: kernel::Slope,
}

/// Over stored texels: the function of a `Sample` that yields what a draw leaves, one value after another.
pub const TEXEL: &str = "skinfit_texel";
/// Over stored texels: the function of a `Sample` that yields what a blur's kernel is made of, and where that moves how:
/// of [taps](Kernel::Taps), for each where it lies and what it weighs, after each how that moves; of a
/// [Gaussian](Kernel::Gaussian) its deviation, of one [over the surface](Kernel::Surface) its variance.
pub const TAPS: &str = "skinfit_taps";
/// Over stored texels: the function of a `Sample`, and of how far its neighbours are apart, that yields a pass' value.
pub const APART: &str = "skinfit_apart";

/// The passes that yield the texels' quantities which fragments look up; none where nothing is computed in texels.
///
/// # Errors
/// When a mesh has no texture coordinates to be drawn with, or an adapter does not do what a pass takes.
pub(super) fn passes(facts: &Facts, found: &Found) -> Result<Vec<Pass>, PlanError> {
    let texels: Vec<&'static Rule> =
        found.rules.iter().copied().filter(|rule| rule.domain == Domain::Texel).collect();
    if texels.is_empty() {
        return Ok(Vec::new());
    }
    let drawn = facts.source == Source::Raster;
    let by_distance = |rule: &&&Rule| rule.blur.as_ref().is_some_and(|blur| blur.kernel == Kernel::Surface);
    if let Some(rule) = texels.iter().find(by_distance).filter(|_| drawn) {
        return Err(PlanError::OverSurface { level: rule.gives[0].0 });
    }
    let blurs = texels.iter().find(|rule| rule.blur.as_ref().is_some_and(|blur| blur.kernel.is_along_axes()));
    if let Some(rule) = blurs.filter(|_| drawn && facts.setup.choices.diffusion.seams == Seams::Joined) {
        return Err(PlanError::Joined { level: rule.gives[0].0 });
    }
    let uv = facts.atlas_uv();
    if drawn && !found.rules.iter().any(|rule| rule.domain == Domain::Vertex && rule.gives_quantity(uv)) {
        return Err(PlanError::NoPlan { goals: uv.to_owned() });
    }
    let depths = depths(&texels);
    let depth = |rule: &Rule| rule.gives.iter().filter_map(|(q, _)| depths.get(q)).max().copied();
    let stored = in_levels(&texels, &found.carried);
    let mut passes = Vec::new();
    for layer in 0..=depths.values().copied().max().unwrap_or(0) {
        let drawn = texels.iter().filter(|rule| rule.blur.is_none() && depth(rule) == Some(layer));
        let given = drawn.flat_map(|rule| {
            rule.gives.iter().map(|(quantity, swizzle)| Level::new(*quantity, rule.given_type(swizzle)))
        });
        let leaves: Vec<Level> = given.filter(|level| stored.contains(level.name.as_str())).collect();
        for leaves in leaves.chunks(LEVELS_A_DRAW) {
            // What was blurred or drawn before stands in levels.
            let stands = |rule: &Rule| {
                let given = |(quantity, _): &(&str, _)| stored.contains(quantity);
                rule.blur.is_some() || (depth(rule) < Some(layer) && rule.gives.iter().all(given))
            };
            passes.push(draw(facts, found, &texels, &stands, leaves)?);
        }
        let blurs = texels.iter().filter(|rule| rule.blur.is_some() && depth(rule) == Some(layer + 1));
        passes.extend(blurs.flat_map(|rule| blurs_of(facts, rule)));
    }
    if facts.dilates() {
        let sampled = found.carried.iter().filter(|on| on.edge.from == Domain::Texel);
        let level = |on: &Carried| Level::new(on.quantity, level_type(on.numbers));
        passes.extend(sampled.map(|on| dilate(facts, &level(on))));
    }
    Ok(passes)
}

/// The levels that fragments look up.
pub(super) fn looked_up(facts: &Facts, carried: &[Carried]) -> Vec<Level> {
    let sampled = carried.iter().filter(|on| on.edge.from == Domain::Texel);
    let levels = sampled.map(|on| Level::new(on.quantity, level_type(on.numbers)));
    levels.map(|level| if facts.dilates() { level.dilated() } else { level }).collect()
}

/// The WGSL type of that many numbers of a level.
const fn level_type(numbers: usize) -> &'static str {
    match numbers {
        1 => "f32",
        2 => "vec2f",
        _ => "vec3f",
    }
}

/// A level, its empty texels filled.
fn dilate(facts: &Facts, source: &Level) -> Pass {
    let mut plan = Plan::of_rules(facts, &[], &[], vec![source.clone()]);
    // Few texels are empty and look further than their neighbours.
    plan.cost = facts.work.share(Domain::Texel) * NEIGHBOURS * TAP_COST;
    plan.wgsl = text::dilate(&plan, source);
    Pass { kind: PassKind::Dilate, leaves: vec![source.dilated()], plan, moving: None }
}

/// Texels around one.
const NEIGHBOURS: f64 = 8.0;

/// A draw by rules of texels; what some of them give stands in levels.
fn draw(
    facts: &Facts,
    found: &Found,
    texels: &[&'static Rule],
    stands: &dyn Fn(&Rule) -> bool,
    leaves: &[Level],
) -> Result<Pass, PlanError> {
    let goals: Vec<&str> = leaves.iter().map(|level| level.name.as_str()).collect();
    let shading = upstream(texels, Domain::Texel, &goals, stands);
    let needed =
        |quantity: &str| shading.iter().any(|rule| rule.needs.iter().any(|(need, _)| *need == quantity));
    let standing = texels.iter().filter(|rule| stands(rule));
    let given = standing.flat_map(|rule| {
        rule.gives.iter().map(|(quantity, swizzle)| Level::new(*quantity, rule.given_type(swizzle)))
    });
    let levels = given.filter(|level| needed(&level.name)).collect();
    let uv = facts.atlas_uv();
    let rules = with_vertices(found, Domain::Texel, &[uv, CHART], shading);
    let mut plan = Plan::of_rules(facts, &rules, &found.carried, levels);
    if facts.source == Source::Raster {
        plan.varyings.push((CHART, "f32"));
        let held = plan.varyings.iter().any(|(name, _)| *name == uv);
        if !held && text::takes_steps(&plan) {
            plan.varyings.push((uv, "vec2f"));
        }
    }
    plan.wgsl = text::draw(&plan, leaves);
    if facts.source == Source::Raster && text::is_between_texels(&plan.wgsl) {
        return Err(PlanError::BetweenTexels { level: leaves[0].name.clone() });
    }
    Ok(Pass { kind: PassKind::Draw, leaves: leaves.to_vec(), plan, moving: None })
}

/// The passes of a rule that reads texels' neighbours: of a blur along the axes one along u, then one along v.
fn blurs_of(facts: &Facts, rule: &'static Rule) -> Vec<Pass> {
    let Some(blur) = &rule.blur else { return Vec::new() };
    let kind = blur.kind;
    if blur.kernel == Kernel::Neighbours {
        let source = Level::new(blur.of, kind);
        let mut plan = blur_plan(facts, rule, &source);
        plan.wgsl = text::neighbours(&plan, rule, &source);
        let leaves = vec![Level::new(rule.gives[0].0, rule.returns)];
        return vec![Pass { kind: PassKind::Neighbours, leaves, plan, moving: None }];
    }
    if blur.kernel == Kernel::Surface {
        let source = Level::new(blur.of, kind);
        let mut plan = blur_plan(facts, rule, &source);
        plan.wgsl = kernel::blur(&plan, rule, Axis::U, &source);
        let leaves = vec![Level::new(rule.gives[0].0, kind)];
        return vec![Pass { kind: PassKind::Surface, leaves, plan, moving: None }];
    }
    let half = || Level::half_of(rule.gives[0].0, kind);
    let directions =
        [(Axis::U, Level::new(blur.of, kind), half()), (Axis::V, half(), Level::new(rule.gives[0].0, kind))];
    let pass = |(axis, source, leaves): (Axis, Level, Level)| {
        let mut plan = blur_plan(facts, rule, &source);
        plan.wgsl = kernel::blur(&plan, rule, axis, &source);
        Pass { kind: PassKind::Blur(axis), leaves: vec![leaves], plan, moving: None }
    };
    directions.into_iter().map(pass).collect()
}

/// What one direction of a blur reads: the level that it blurs, and those that its kernel needs.
fn blur_plan(facts: &Facts, rule: &'static Rule, source: &Level) -> Plan {
    let uniform = |name: &str| super::quantity::Constant::from_name(name).is_some();
    let needs = rule.needs.iter().skip(1).filter(|(need, _)| !uniform(need) && *need != source.name);
    let mut levels = vec![source.clone()];
    levels.extend(needs.map(|&(need, kind)| Level::new(need, kind)));
    let mut plan = Plan::of_rules(facts, &[rule], &[], levels);
    plan.cost /= DIRECTIONS;
    plan
}
