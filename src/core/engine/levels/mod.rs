//! Levels of the UV atlas over stored texels: what draws and blurs leave, and what samples look up of it.
//!
//! The renderer draws the same passes on an adapter. Here their rules run as samples' do, operation by operation in f32
//! (for the engine) or f64 (for what is exact); which texels a blur or a lookup weighs is that of
//! `shader/atlas/blur.wgsl`, `blur_tangent.wgsl` and `level.wgsl`. Texel by texel, so nothing depends on threads.
//!
//! - this module: [`LevelMaker`], which makes levels anew when a number changes that they are made with
//! - `records`: levels in memory; `run`: a pass over them
//! - `gaussian`: one direction of a Gaussian, of a level and of how it moves; `blur`: likewise by a rule's own taps;
//!   `neighbours`: how far these lie apart; `surface`: sums by distance in space; `look_up`: what samples find

mod blur;
mod gaussian;
mod look_up;
mod neighbours;
mod records;
mod run;
mod surface;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

pub use self::look_up::{Corners, Finder, corners_of};
pub use self::records::Made;
use self::run::Run;
use super::cubes_at::CubesAt;
use crate::bake::stacks::Stack;
use crate::model::effects::Effects;
use crate::model::params::Params;
use crate::model::real::Real;
use crate::program::graph::Input;
use crate::program::levels::{LevelPass, LevelProgram};
use crate::program::shading::constant;
use crate::samples::{Atlas, ViewSamples};
use crate::shader::PlanError;

/// What levels are made of: f32 or f64.
pub trait Number: Real<Texel = Self, Wide = Self, Mask = bool> + From<f32> + Into<f64> + Send + Sync {}
impl Number for f32 {}
impl Number for f64 {}

/// A number of up to three components.
type Texel<R> = [R; 3];

/// Makes the levels of a plan's passes.
#[derive(Debug)]
pub struct LevelMaker<R> {
    program: LevelProgram,
    /// The numbers that texels share, for each pass.
    constants: Vec<Input>,
    /// Stacks of cubes that a pass looks up.
    stacks: Vec<Stack>,
    last: Mutex<Vec<Last<R>>>,
    count: AtomicU64,
}

/// Levels, and what they were made with.
#[derive(Debug)]
struct Last<R> {
    atlas: Arc<Atlas>,
    with: Vec<f64>,
    levels: Arc<Made<R>>,
}

impl<R: Number> LevelMaker<R> {
    /// Of a plan's passes.
    #[must_use]
    pub fn new(program: LevelProgram) -> Self {
        let mut constants: Vec<Input> = Vec::new();
        for input in program.passes.iter().flat_map(|pass| pass.steps.inputs()) {
            if !constants.contains(input) {
                constants.push(input.clone());
            }
        }
        let names = |pass: &LevelPass| -> Vec<String> { pass.steps.resources().to_vec() };
        let read: Vec<String> = program.passes.iter().flat_map(names).collect();
        let stacks = Stack::read(&read);
        Self { program, constants, stacks, last: Mutex::default(), count: AtomicU64::new(0) }
    }

    /// The passes.
    #[must_use]
    pub const fn program(&self) -> &LevelProgram {
        &self.program
    }

    /// How often levels were made.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    /// Whether levels are made for how they move, too: a parameter moves them that is free.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.program.moves
    }

    /// Rows of what samples look up, for each record of theirs.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.program.looked_up.iter().map(|(_, count)| count).sum()
    }

    /// The row of a number that samples look up; `None` for another.
    #[must_use]
    pub fn row(&self, input: &Input) -> Option<usize> {
        let mut row = 0;
        for (name, count) in &self.program.looked_up {
            if *name == input.name && input.component < *count {
                return Some(row + input.component);
            }
            row += count;
        }
        None
    }

    /// The numbers that levels at `params` are made with: where they are the same, so are the levels.
    #[must_use]
    pub fn made_with(&self, params: &Params) -> Vec<f64> {
        let numbers = self.constants.iter().map(|input| constant(input, params).unwrap_or(0.0));
        numbers.chain(self.stacks.iter().map(|stack| stack.place(params))).collect()
    }

    /// Refuse samples without the texels that `effects` are computed in, or without texture coordinates.
    ///
    /// # Errors
    /// When they lack them; texels that were made for other effects may.
    pub fn check(&self, effects: Effects, samples: &ViewSamples) -> Result<(), PlanError> {
        let holds = |atlas: &Atlas| self.program.fields().iter().all(|input| atlas.row(input).is_some());
        let placed = samples.surface.places().uv.is_some() && samples.atlas.as_deref().is_some_and(holds);
        // A view that holds nothing looks nothing up.
        if self.program.is_empty() || samples.records() == 0 || placed {
            return Ok(());
        }
        Err(PlanError::no_atlas(effects))
    }

    /// The levels of an atlas that samples look up, at `params`, those texels with them that a lookup by one fetch has
    /// filled: the last ones, where nothing has changed that they are
    /// made with. `cubes` gives the cubes at `params`.
    pub fn levels(
        &self,
        atlas: &Arc<Atlas>,
        params: &Params,
        cubes: impl FnOnce() -> CubesAt<R>,
    ) -> Arc<Made<R>> {
        let with = self.made_with(params);
        if let Some(levels) = self.known(atlas, &with) {
            return levels;
        }
        // Nothing is locked meanwhile: a thread that waits for others may come here again.
        self.count.fetch_add(1, Ordering::Relaxed);
        let reads = self.program.passes.iter().any(|pass| !pass.steps.resources().is_empty());
        let cubes = if reads { cubes() } else { CubesAt::dark(|x| R::from(x)) };
        let mut levels = self.make(atlas, params, &cubes);
        levels.retain(|name| self.program.looked_up.iter().any(|(found, _)| found == name));
        if self.program.dilated {
            levels.fill(atlas.dilation());
        }
        let levels = Arc::new(levels);
        let made = Last { atlas: Arc::clone(atlas), with, levels: Arc::clone(&levels) };
        self.last.lock().unwrap_or_else(PoisonError::into_inner).push(made);
        levels
    }

    /// Levels that were made with the same numbers. Others go, and those of an atlas that nobody else has any more, such
    /// as an earlier frame's.
    fn known(&self, atlas: &Arc<Atlas>, with: &[f64]) -> Option<Arc<Made<R>>> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.retain(|made| made.with == with && Arc::strong_count(&made.atlas) > 1);
        let made = last.iter().find(|made| Arc::ptr_eq(&made.atlas, atlas))?;
        Some(Arc::clone(&made.levels))
    }

    /// Every level, those between with them.
    #[must_use]
    pub fn make(&self, atlas: &Atlas, params: &Params, cubes: &CubesAt<R>) -> Made<R> {
        let mut made = Made::new(atlas.covered());
        if atlas.covered() == 0 {
            return made;
        }
        for pass in &self.program.passes {
            let record = Run::new(pass, (atlas, &made), params, cubes).record();
            made.push(pass.leaves.iter().map(|(name, _)| name.clone()), record);
        }
        made
    }
}
