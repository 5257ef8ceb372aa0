//! Passes that leave how levels move along a seed.
//!
//! A draw leaves the tangents of what it leaves, by the chain rule over its rules. A blur is linear in what it blurs: its
//! tangent is the same pass over the tangent level. Where its kernel moves, too (the radius is free), the taps' own
//! change is added.

use std::collections::BTreeMap;

use super::kernel::{self, Slope};
use super::text;
use super::{Axis, Level, MovingKernel, Pass, PassKind};
use crate::shader::emit::Plan;
use crate::shader::rule::Rule;
use crate::shader::tangent::chain::{Chain, Seed};
use crate::shader::tangent::{TangentError, Tangents};

/// What the levels of a plan's passes do along a seed.
#[derive(Clone, Debug, Default)]
pub struct Along {
    /// Passes to be drawn after the plan's own, whose levels they read.
    pub passes: Vec<Pass>,
    /// Of each the place of the plan's pass whose leaves' tangents it leaves.
    pub derived: Vec<usize>,
    /// The levels that move, by their names, and the level that holds how.
    pub moved: BTreeMap<String, Level>,
}

impl Along {
    /// Of a plan's passes; empty where none of its levels moves.
    ///
    /// # Errors
    /// When a rule does what the chain rule is not written for.
    pub fn new(plan: &Plan, seed: &Seed) -> Result<Self, TangentError> {
        let mut along = Self::default();
        for (at, pass) in plan.passes.iter().enumerate() {
            let tangent = match pass.kind {
                PassKind::Draw => along.draw(pass, seed)?,
                PassKind::Blur(axis) => along.blur(pass, axis, seed)?,
                PassKind::Surface => {
                    along.check_places(pass)?;
                    // It has no axis, and its kernel asks for none.
                    along.blur(pass, Axis::U, seed)?
                }
                PassKind::Neighbours => along.neighbours(pass)?,
                PassKind::Dilate => along.dilate(pass),
            };
            along.derived.extend(tangent.as_ref().map(|_| at));
            along.passes.extend(tangent);
        }
        Ok(along)
    }

    /// The level that holds how another moves.
    fn leave(&mut self, level: &Level) -> Level {
        let tangent = Level::new(format!("d_{}", level.name), level.kind);
        self.moved.insert(level.name.clone(), tangent.clone());
        tangent
    }

    fn draw(&mut self, pass: &Pass, seed: &Seed) -> Result<Option<Pass>, TangentError> {
        let mut plan = pass.plan.clone();
        let moving: Vec<Level> =
            plan.levels.iter().filter_map(|level| self.moved.get(&level.name).cloned()).collect();
        plan.levels.extend(moving);
        let needs = || plan.steps.iter().flat_map(|step| &step.rule.needs);
        let tangent = |name: &'static str| Some((name, self.moved.get(name)?.name.clone()));
        let read = needs().filter_map(|(name, _)| tangent(name)).collect();
        let chain = Chain::of_texels(&plan, std::slice::from_ref(seed), vec![read])?;
        plan.resources.extend(&chain.resources);
        plan.constants.extend(&chain.constants);
        let moves = |level: &&Level| chain.moved[0].contains_key(level.name.as_str());
        let leaving: Vec<Level> = pass.leaves.iter().filter(moves).cloned().collect();
        if leaving.is_empty() {
            return Ok(None);
        }
        let value = |level: &Level| chain.moved[0][level.name.as_str()].clone();
        let targets: Vec<(Level, String)> =
            leaving.iter().map(|level| (self.leave(level), value(level))).collect();
        plan.wgsl = text::draw_of(&plan, &chain.functions, &chain.lines[0], &targets);
        let leaves = targets.into_iter().map(|(level, _)| level).collect();
        Ok(Some(Pass { kind: pass.kind, leaves, plan, moving: None }))
    }

    fn blur(&mut self, pass: &Pass, axis: Axis, seed: &Seed) -> Result<Option<Pass>, TangentError> {
        let (rule, source) = (pass.plan.steps[0].rule, pass.plan.levels[0].clone());
        let moved = self.moved.get(&source.name).cloned();
        let slope = self.kernel_slope(pass, rule, seed)?;
        let mut plan = pass.plan.clone();
        let mut moving = None;
        match (moved, slope) {
            (None, None) => return Ok(None),
            (Some(moved), None) => {
                plan.levels[0] = moved.clone();
                plan.wgsl = kernel::blur(&plan, rule, axis, &moved);
            }
            (moved, Some(slope)) => {
                plan.levels.extend(moved.iter().chain(&slope.levels).cloned());
                plan.wgsl = kernel::blur_tangent(&plan, rule, axis, (&source, moved.as_ref()), &slope);
                moving = Some(MovingKernel { blurred: moved, slope });
            }
        }
        let leaves = pass.leaves.iter().map(|level| self.leave(level)).collect();
        Ok(Some(Pass { kind: pass.kind, leaves, plan, moving }))
    }

    /// Where texels lie is what a sum over the surface reads of them: no seed moves that.
    fn check_places(&self, pass: &Pass) -> Result<(), TangentError> {
        let rule = pass.plan.steps[0].rule;
        let mut beside = rule.blur.iter().flat_map(|blur| &blur.beside);
        match beside.find(|(name, _)| self.moved.contains_key(*name)) {
            None => Ok(()),
            Some((name, _)) => {
                let (function, what) =
                    (rule.function.to_owned(), format!("sums over a surface whose {name} moves"));
                Err(TangentError::Unsupported { function, what })
            }
        }
    }

    /// Empty texels are means of others: how they move is that of how these do.
    fn dilate(&mut self, pass: &Pass) -> Option<Pass> {
        let moved = self.moved.get(&pass.plan.levels[0].name).cloned()?;
        let leaves = pass.leaves.iter().map(|level| self.leave(level)).collect();
        let mut plan = pass.plan.clone();
        plan.levels[0] = moved.clone();
        plan.wgsl = text::dilate(&plan, &moved);
        Some(Pass { leaves, plan, ..pass.clone() })
    }

    /// What is read of neighbours is where the surface lies: no seed moves that, nor what is made of it.
    fn neighbours(&self, pass: &Pass) -> Result<Option<Pass>, TangentError> {
        let source = &pass.plan.levels[0].name;
        if !self.moved.contains_key(source) {
            return Ok(None);
        }
        let function = pass.plan.steps[0].rule.function.to_owned();
        Err(TangentError::Unsupported { function, what: format!("how neighbours of {source} lie apart") })
    }

    /// How a kernel's value moves; `None` where it stays.
    pub(super) fn kernel_slope(
        &self,
        pass: &Pass,
        rule: &Rule,
        seed: &Seed,
    ) -> Result<Option<Slope>, TangentError> {
        let mut levels = Vec::new();
        let mut along = |name: &str| match &seed.named {
            Some(named) if named.name == name => Some(named.tangent.clone()),
            _ => self.moved.get(name).map(|level| {
                levels.push(level.clone());
                level.name.clone()
            }),
        };
        let slopes: Vec<Option<String>> = rule.parameters().iter().map(|(name, _)| along(name)).collect();
        let moving: Vec<bool> = slopes.iter().map(Option::is_some).collect();
        let mut tangents = Tangents::new(&pass.plan.declarations(true))?;
        let Some(tangent) = tangents.of(rule.function, &moving)? else { return Ok(None) };
        let still = |kind: &str| tangent.of_all.then(|| format!("{kind}()"));
        let given = slopes.into_iter().zip(rule.parameters());
        let along = given.filter_map(|(slope, (_, kind))| slope.or_else(|| still(kind))).collect();
        Ok(Some(Slope { name: tangent.name, along, functions: tangents.text().to_owned(), levels }))
    }
}
