//! Passes over stored texels backwards: what the numbers that a pass is made of get of what its leaves get.
//!
//! A draw is a function of its own texel: what a leaf gets, times how the leaf moves along a seed, goes to that seed. A blur is
//! a mean: each texel that it reads gets the share that it has in it; and what moves the kernel, how the mean moves with that.

use std::collections::BTreeSet;

use super::buffers::{EACH_TEXEL, StoredTexels, Text};
use super::columns::{Columns, by_weights};
use super::kernel::{TAP, of_kernel, taps};
use super::layers::Layers;
use super::tangent::Along;
use super::{Axis, Level, Pass, PassKind, text};
use crate::shader::emit::Plan;
use crate::shader::module::uniform;
use crate::shader::search::components;
use crate::shader::tangent::TangentError;
use crate::shader::tangent::chain::{Chain, Moved, Seed};

const BLUR: &str = concat!(include_str!("here_stored.wgsl"), include_str!("blur_adjoint.wgsl"));

/// A pass backwards, as a compute shader of a thread a texel that the mesh covers.
///
/// Its module is `declarations`, then what declares the functions below, then `entry`, which is left open: lines that take
/// [`moved`](Self::moved) to where it is wanted follow, and a brace. The texel is `i`-th of those that are covered, and lies
/// `here`.
#[derive(Clone, Debug)]
pub struct PassAdjoint {
    /// Its constants and resources, group 0.
    pub plan: Plan,
    /// The levels that it leaves.
    pub leaves: Vec<Level>,
    /// Of a blur the level that it reads. Its shader calls `gained(vec2i) -> vec3f`, what its leaf gets at a place, and
    /// `give(vec2i, vec3f)`, for what the level that it reads gets there.
    pub source: Option<String>,
    /// How its leaves move.
    pub moved: Vec<MovedLeaf>,
    /// All before the entry point; group 1 as passes forwards have it.
    pub declarations: String,
    /// `cs_main`.
    pub entry: String,
}

/// How a leaf moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovedLeaf {
    /// With what.
    pub by: Mover,
    /// Which of the leaves.
    pub leaf: usize,
    /// WGSL of a `vec3f`.
    pub value: String,
}

/// What moves a leaf.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mover {
    /// One of the seeds.
    Seed(usize),
    /// A number of a level that a draw reads.
    Level(String, usize),
}

/// Passes backwards, in the order in which they are to be run.
#[derive(Clone, Debug, Default)]
pub struct PassAdjoints {
    /// Those that move something.
    pub passes: Vec<PassAdjoint>,
    /// The levels that move with any seed.
    pub moving: BTreeSet<String>,
}

impl PassAdjoints {
    /// Of a plan's passes over stored texels, along `seeds`; levels stand as `layers` have them.
    ///
    /// # Errors
    /// When a rule does what the chain rule is not written for, or a kernel moves with what texels hold.
    pub fn new(
        plan: &Plan,
        seeds: &[Seed],
        texels: &StoredTexels<'_>,
        layers: &Layers,
    ) -> Result<Self, TangentError> {
        let mut moving = BTreeSet::new();
        for seed in seeds {
            moving.extend(Along::new(plan, seed)?.moved.into_keys());
        }
        let text = Text { layers, texels };
        let mut passes = Vec::new();
        for pass in plan.passes.iter().rev() {
            if !pass.leaves.iter().any(|leaf| moving.contains(&leaf.name)) {
                continue;
            }
            passes.extend(match pass.kind {
                PassKind::Blur(axis) => Some(blur(&text, pass, axis, seeds, &moving)?),
                PassKind::Draw => draw(&text, pass, seeds, &moving)?,
                // Where the surface lies moves along no seed, and sums over it are the processor's.
                PassKind::Neighbours | PassKind::Surface | PassKind::Dilate => None,
            });
        }
        Ok(Self { passes, moving })
    }
}

/// A level's value as a vector of three numbers.
fn three(kind: &str, value: &str) -> String {
    match components(kind) {
        1 => format!("vec3f({value}, 0.0, 0.0)"),
        2 => format!("vec3f({value}, 0.0)"),
        _ => value.to_owned(),
    }
}

/// A draw; `None` where nothing moves what it leaves.
fn draw(
    text: &Text<'_>,
    pass: &Pass,
    seeds: &[Seed],
    moving: &BTreeSet<String>,
) -> Result<Option<PassAdjoint>, TangentError> {
    let mut plan = pass.plan.clone();
    let mut movers: Vec<Mover> = (0..seeds.len()).map(Mover::Seed).collect();
    let mut all = seeds.to_vec();
    let needs = || plan.steps.iter().flat_map(|step| &step.rule.needs);
    for level in plan.levels.iter().filter(|level| moving.contains(&level.name)) {
        let Some((name, _)) = needs().find(|(name, _)| *name == level.name) else { continue };
        for component in 0..components(level.kind) {
            movers.push(Mover::Level(level.name.clone(), component));
            all.push(Seed::named(name, &level.unit(component)));
        }
    }
    let chain = Chain::of_texels(&plan, &all, vec![Moved::new(); all.len()])?;
    plan.resources.extend(&chain.resources);
    plan.constants.extend(&chain.constants);
    let (mut targets, mut moved) = (Vec::new(), Vec::new());
    for (by, along) in movers.iter().zip(&chain.moved) {
        for (leaf, Level { name, kind }) in pass.leaves.iter().enumerate() {
            if let Some(value) = along.get(name.as_str()) {
                let target = format!("moved_{}", targets.len());
                let value_there = three(kind, &format!("texel.{target}"));
                moved.push(MovedLeaf { by: by.clone(), leaf, value: value_there });
                targets.push((Level::new(target, kind), value.clone()));
            }
        }
    }
    if moved.is_empty() {
        return Ok(None);
    }
    let lines = chain.shared + &chain.lines.concat();
    let wgsl = text::draw_of(&plan, &chain.functions, &lines, &targets);
    let (functions, set) = text.of_texel(&plan, &wgsl, 0, &|level| level.to_owned());
    let entry = format!("{EACH_TEXEL}{set}    let texel = {}(at);\n", super::TEXEL);
    Ok(Some(PassAdjoint {
        plan,
        leaves: pass.leaves.clone(),
        source: None,
        moved,
        declarations: functions + &text.head(),
        entry,
    }))
}

/// One direction of a blur.
fn blur(
    text: &Text<'_>,
    pass: &Pass,
    axis: Axis,
    seeds: &[Seed],
    moving: &BTreeSet<String>,
) -> Result<PassAdjoint, TangentError> {
    let plan = &pass.plan;
    let (rule, source) = (plan.steps[0].rule, &plan.levels[0]);
    if let Some(level) = of_kernel(plan, rule).iter().find(|level| moving.contains(&level.name)) {
        let what = format!("a blur whose kernel moves with {}", level.name);
        return Err(TangentError::Unsupported { function: rule.function.to_owned(), what });
    }
    let kernel = taps(&plan.facts, rule, axis, uniform);
    let by_deviation = &kernel.by_deviation;
    let mut columns = Columns { by_deviation: by_deviation.is_some(), ..Columns::default() };
    let (mut functions, mut moved) = (Vec::new(), Vec::new());
    for (k, seed) in seeds.iter().enumerate() {
        let Some(slope) = Along::default().kernel_slope(pass, rule, seed)? else { continue };
        if moved.is_empty() {
            by_deviation.iter().for_each(|by| columns.share(by));
        }
        if !functions.contains(&slope.functions) {
            functions.push(slope.functions.clone());
        }
        columns.mover(k, "", &slope.call(rule, axis, TAP));
        let value = if columns.by_deviation {
            format!("deviation_moves{k} * {}", by_weights(""))
        } else {
            by_weights(&k.to_string())
        };
        moved.push(MovedLeaf { by: Mover::Seed(k), leaf: 0, value });
    }
    Ok(PassAdjoint {
        plan: plan.clone(),
        leaves: pass.leaves.clone(),
        source: Some(source.name.clone()),
        moved,
        declarations: plan.declarations(true) + &functions.concat() + &text.head(),
        entry: text.of_blur(BLUR, plan, axis, &kernel, &columns),
    })
}
