//! Passes that leave how levels move along a seed.
//!
//! A draw leaves the tangents of what it leaves, by the chain rule over its rules. A blur is linear in what it blurs: its
//! tangent is the same pass over the tangent level. Where its kernel moves, too (the radius is free), the taps' own
//! change is added.

use std::collections::BTreeMap;

use super::text::{self, draw_of, filled, texel};
use super::{Level, Pass, PassKind};
use crate::shader::emit::Plan;
use crate::shader::quantity::Constant;
use crate::shader::rule::Rule;
use crate::shader::tangent::chain::{Chain, Seed};
use crate::shader::tangent::{TangentError, Tangents};

/// What the levels of a plan's passes do along a seed.
#[derive(Clone, Debug, Default)]
pub struct Along {
    /// Passes to be drawn after the plan's own, whose levels they read.
    pub passes: Vec<Pass>,
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
        for pass in &plan.passes {
            let tangent = match pass.kind {
                PassKind::Draw => along.draw(pass, seed)?,
                PassKind::Blur(_) => along.blur(pass, seed)?,
            };
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
        let chain = Chain::of_texels(&plan, seed, read)?;
        plan.resources.extend(&chain.resources);
        for constant in [Constant::KeyByAzimuth, Constant::KeyByElevation] {
            if chain.lines[0].contains(constant.name()) && !plan.constants.contains(&constant) {
                plan.constants.push(constant);
            }
        }
        let moves = |level: &&Level| chain.moved[0].contains_key(level.name.as_str());
        let leaving: Vec<Level> = pass.leaves.iter().filter(moves).cloned().collect();
        let target = |level: &Level| {
            let value = &chain.moved[0][level.name.as_str()];
            (format!("d_{}", level.name), texel(level, value))
        };
        let targets: Vec<(String, String)> = leaving.iter().map(target).collect();
        if targets.is_empty() {
            return Ok(None);
        }
        plan.wgsl = draw_of(&plan, &chain.functions, &chain.lines[0], &targets);
        let leaves = leaving.iter().map(|level| self.leave(level)).collect();
        Ok(Some(Pass { kind: pass.kind, leaves, plan }))
    }

    fn blur(&mut self, pass: &Pass, seed: &Seed) -> Result<Option<Pass>, TangentError> {
        let PassKind::Blur(axis) = pass.kind else { return Ok(None) };
        let (rule, source) = (pass.plan.steps[0].rule, pass.plan.levels[0].clone());
        let moved = self.moved.get(&source.name).cloned();
        let kernel = self.kernel_slope(pass, rule, seed, axis)?;
        let mut plan = pass.plan.clone();
        plan.wgsl = match (moved, kernel) {
            (None, None) => return Ok(None),
            (Some(moved), None) => {
                plan.levels[0] = moved.clone();
                text::blur(&plan, rule, axis, &moved)
            }
            (moved, Some((slope, functions, levels))) => {
                let of =
                    |level: &Level, place: &str| format!("textureLoad({}, {place}, 0).xyz", level.bound());
                let at =
                    |place: &str| moved.as_ref().map_or("vec3f(0.0)".to_owned(), |level| of(level, place));
                plan.levels.extend(moved.iter().cloned().chain(levels));
                let template = include_str!("blur_tangent.wgsl")
                    .replace("{slope}", &slope)
                    .replace("{moved}", &at("near"))
                    .replace("{moved_here}", &at("here"));
                filled(&format!("{functions}{template}"), &plan, rule, axis, &source)
            }
        };
        let leaves = pass.leaves.iter().map(|level| self.leave(level)).collect();
        Ok(Some(Pass { kind: pass.kind, leaves, plan }))
    }

    /// How a kernel's value moves: the call, the functions that it takes, and the levels that it reads; `None` where it
    /// stays.
    fn kernel_slope(
        &self,
        pass: &Pass,
        rule: &Rule,
        seed: &Seed,
        axis: super::Axis,
    ) -> Result<Option<(String, String, Vec<Level>)>, TangentError> {
        let mut levels = Vec::new();
        let mut along = |name: &str, kind: &str| match seed {
            Seed::Named { name: seeded, tangent } if *seeded == name => Some(tangent.clone()),
            _ => self.moved.get(name).map(|level| {
                levels.push(level.clone());
                format!("{kind}(textureLoad({}, here, 0).{})", level.bound(), level.swizzle())
            }),
        };
        let slopes: Vec<Option<String>> =
            rule.parameters().iter().map(|(name, kind)| along(name, kind)).collect();
        let moving: Vec<bool> = slopes.iter().map(Option::is_some).collect();
        let mut tangents = Tangents::new(&pass.plan.declarations(true))?;
        let Some(tangent) = tangents.of(rule.function, &moving)? else { return Ok(None) };
        let mut given = text::arguments(rule, axis.step());
        for (slope, (_, kind)) in slopes.into_iter().zip(rule.parameters()) {
            let still = tangent.of_all.then(|| format!("{kind}()"));
            given.extend(slope.or(still));
        }
        let call = format!("{}({})", tangent.name, given.join(", "));
        Ok(Some((call, tangents.text().to_owned(), levels)))
    }
}
