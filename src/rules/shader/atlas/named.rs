//! Passes over stored texels by the levels that they leave: each with those that leave how these move, along every seed.

use super::{Level, Pass};
use crate::shader::emit::Plan;
use crate::shader::tangent::chain::Chain;

/// A pass, and of one that leaves how levels move, along which seed, and the names of those.
pub struct Named<'a> {
    /// The pass.
    pub pass: &'a Pass,
    seed: Option<(usize, Vec<String>)>,
}

impl Named<'_> {
    /// The name of a level of the pass among those of all seeds.
    #[must_use]
    pub fn name(&self, name: &str) -> String {
        match &self.seed {
            Some((k, moved)) if moved.iter().any(|level| level == name) => tangent_of(*k, name),
            _ => name.to_owned(),
        }
    }

    /// The names of what it leaves, in the order of its leaves.
    pub(super) fn leaves(&self) -> impl Iterator<Item = (String, &Level)> {
        self.pass.leaves.iter().map(|level| (self.name(&level.name), level))
    }
}

/// Along the `k`-th seed: a level that holds how another moves.
fn tangent_of(k: usize, name: &str) -> String {
    format!("d{k}{}", name.strip_prefix('d').unwrap_or(name))
}

/// A plan's passes in their order, each before those that leave how what it leaves moves: each seed has tangents of its own;
/// what does not move is the plan's.
#[must_use]
pub fn groups<'a>(plan: &'a Plan, chain: &'a Chain) -> Vec<Vec<Named<'a>>> {
    let group = |(at, pass): (usize, &'a Pass)| {
        let tangents = chain.along.iter().enumerate().flat_map(move |(k, along)| {
            let moved: Vec<String> = along.moved.values().map(|level| level.name.clone()).collect();
            let own = along.passes.iter().zip(&along.derived).filter(move |(_, from)| **from == at);
            own.map(move |(pass, _)| Named { pass, seed: Some((k, moved.clone())) })
        });
        std::iter::once(Named { pass, seed: None }).chain(tangents).collect()
    };
    plan.passes.iter().enumerate().map(group).collect()
}
