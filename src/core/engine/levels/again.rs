//! Levels made again: of what was made before, all stays that no number has changed, and the memory of the rest is used.
//!
//! Fresh memory is handed out page by page, which takes longer than a blur of what stands in it.

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};

use super::records::{Made, Record};
use super::run::{Run, order};
use super::{LevelMaker, Number};
use crate::bake::stacks::Stack;
use crate::engine::cubes_at::CubesAt;
use crate::model::params::Params;
use crate::program::levels::{LevelPass, LevelProgram};
use crate::program::shading::constant;
use crate::samples::Atlas;

/// Which passes read what others leave, and what is kept of it.
#[derive(Debug)]
pub(super) struct Flow {
    /// The passes that each reads.
    reads: Vec<Vec<usize>>,
    /// The last pass that reads each.
    last: Vec<usize>,
    /// Whether samples look up what a pass leaves.
    found: Vec<bool>,
    /// Whether it is kept from time to time: samples look it up, or no free parameter moves it.
    kept: Vec<bool>,
}

impl Flow {
    pub(super) fn new(program: &LevelProgram) -> Self {
        let passes = &program.passes;
        let mut left: BTreeMap<&str, usize> = BTreeMap::new();
        let (mut reads, mut last): (Vec<Vec<usize>>, _) = (Vec::new(), vec![0; passes.len()]);
        for (at, pass) in passes.iter().enumerate() {
            let mut of_pass: Vec<usize> = pass.reads().filter_map(|name| left.get(name).copied()).collect();
            of_pass.sort_unstable();
            of_pass.dedup();
            of_pass.iter().for_each(|&read| last[read] = at);
            reads.push(of_pass);
            left.extend(pass.leaves.iter().map(|(name, _)| (name.as_str(), at)));
        }
        let is_found = |pass: &LevelPass| {
            pass.leaves.iter().any(|(name, _)| program.looked_up.iter().any(|(found, _)| found == name))
        };
        let found: Vec<bool> = passes.iter().map(is_found).collect();
        let kept = passes.iter().zip(&found).map(|(pass, found)| *found || !pass.moves).collect();
        Self { reads, last, found, kept }
    }

    /// Which passes have to run, where each would be made with the numbers `with`: those that samples look up or that
    /// others need, and that are not there as they would be. `all`: every one.
    fn wanted<R: Number>(&self, before: &Made<R>, with: &[Vec<f64>], all: bool) -> Vec<bool> {
        let mut stale = vec![false; with.len()];
        for (at, with) in with.iter().enumerate() {
            stale[at] = !before.was_made_with(at, with) || self.reads[at].iter().any(|&read| stale[read]);
        }
        let mut wanted: Vec<bool> = self.found.iter().map(|found| *found || all).collect();
        for at in (0..with.len()).rev() {
            wanted[at] &= stale[at] || before.made_with(at, &with[at]).is_none();
            if wanted[at] {
                self.reads[at].iter().for_each(|&read| wanted[read] = true);
            }
        }
        wanted
    }
}

/// The numbers that a pass is made with, beside what other passes leave.
fn numbers(pass: &LevelPass, params: &Params) -> Vec<f64> {
    let constants = pass.steps.inputs().iter().map(|input| constant(input, params).unwrap_or(0.0));
    let stacks = Stack::read(pass.steps.resources());
    constants.chain(stacks.iter().map(|stack| stack.place(params))).collect()
}

impl<R: Number> LevelMaker<R> {
    /// Levels at `params`, of what was made before of the same atlas. With `all`, those between are left, too, and no more
    /// than the covered texels are.
    pub(super) fn make_again(
        &self,
        mut before: Made<R>,
        atlas: &Atlas,
        params: &Params,
        cubes: &CubesAt<R>,
        all: bool,
    ) -> Made<R> {
        let mut made = Made::new(atlas.covered());
        if atlas.covered() == 0 {
            return made;
        }
        let with: Vec<Vec<f64>> = self.program.passes.iter().map(|pass| numbers(pass, params)).collect();
        let wanted = self.flow.wanted(&before, &with, all);
        for ((at, pass), with) in self.program.passes.iter().enumerate().zip(with) {
            let mut record = before.made_with(at, &with).map(Arc::clone).unwrap_or_default();
            if wanted[at] {
                drop(record);
                let memory = before.take(at).or_else(|| self.memory(pass, atlas)).unwrap_or_default();
                let mut fresh = R::leave(&Run::new(pass, (atlas, &made), params, cubes), memory);
                if self.program.dilated && self.flow.found[at] && !all {
                    fresh.fill(atlas.dilation());
                }
                record = Arc::new(fresh);
            }
            let leaves = order(pass, &made).into_iter().map(|leaf| pass.leaves[leaf].0.clone());
            made.push(leaves, record, with);
            if wanted[at] && !all {
                self.release(&mut made, at);
            }
        }
        made
    }

    /// Memory that nothing stands in: the smallest with room for a pass' record, or the largest, which is given up.
    fn memory(&self, pass: &LevelPass, atlas: &Atlas) -> Option<Vec<R>> {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let count = Record::<R>::room(pass.leaves.len(), atlas.covered());
        let has_room = (0..spare.len()).filter(|&at| spare[at].len() >= count);
        let best = has_room.min_by_key(|&at| spare[at].len());
        let best = best.or_else(|| (0..spare.len()).max_by_key(|&at| spare[at].len()))?;
        Some(spare.swap_remove(best))
    }

    /// Give up what was read last by a pass, unless it is kept.
    fn release(&self, made: &mut Made<R>, pass: usize) {
        for &read in &self.flow.reads[pass] {
            if self.flow.last[read] == pass && !self.flow.kept[read] {
                let memory = made.take(read);
                self.spare.lock().unwrap_or_else(PoisonError::into_inner).extend(memory);
            }
        }
    }
}
