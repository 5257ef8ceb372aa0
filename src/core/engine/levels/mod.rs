//! Levels of the UV atlas over stored texels: what draws and blurs leave, and what samples look up of it.
//!
//! The renderer draws the same passes on an adapter. Here their rules run as samples' do, operation by operation in f32
//! (for the engine) or f64 (for what is exact); which texels a blur or a lookup weighs is that of
//! `shader/atlas/blur.wgsl`, `blur_tangent.wgsl` and `level.wgsl`. Texel by texel, so nothing depends on threads.
//!
//! - this module: [`LevelMaker`], which makes levels anew when a number changes that they are made with
//! - `number`: what levels are made of, `wide`: several at once; `records`: levels in memory, `block`: what of one is read together
//! - `again`: which passes have to run again, and whose memory they may have; `run`: a pass
//! - `gaussian`: one direction of a Gaussian, of a level and of how it moves, by `taps`; `blur`: likewise by a rule's own;
//!   `neighbours`: how far these lie apart; `surface`: sums by distance in space; `look_up`: what samples find

mod again;
mod block;
mod blur;
mod gaussian;
mod look_up;
mod neighbours;
mod number;
mod records;
mod run;
mod surface;
mod taps;
#[cfg(test)]
mod tests;
mod wide;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use self::again::Flow;
pub use self::look_up::{Corners, Finder, corners_of};
pub use self::number::Number;
pub use self::records::Made;
use super::cubes_at::CubesAt;
use crate::bake::stacks::Stack;
use crate::model::effects::Effects;
use crate::model::params::Params;
use crate::program::graph::Input;
use crate::program::levels::{LevelPass, LevelProgram};
use crate::program::shading::constant;
use crate::samples::{Atlas, ViewSamples};
use crate::shader::PlanError;

/// A number of up to three components.
type Texel<R> = [R; 3];

/// Makes the levels of a plan's passes.
#[derive(Debug)]
pub struct LevelMaker<R> {
    program: LevelProgram,
    flow: Flow,
    /// The numbers that texels share, for each pass.
    constants: Vec<Input>,
    /// Stacks of cubes that a pass looks up.
    stacks: Vec<Stack>,
    last: Mutex<Vec<Last<R>>>,
    /// Memory that no level stands in any more.
    spare: Mutex<Vec<Vec<R>>>,
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
        let (stacks, flow) = (Stack::read(&read), Flow::new(&program));
        let (last, spare) = (Mutex::default(), Mutex::default());
        Self { program, flow, constants, stacks, last, spare, count: AtomicU64::new(0) }
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
    /// filled. The last ones, where nothing has changed that they are made with; else what that changes is made anew, in the
    /// memory of the last ones where nobody else has these. `cubes` gives the cubes at `params`.
    pub fn levels(
        &self,
        atlas: &Arc<Atlas>,
        params: &Params,
        cubes: impl FnOnce() -> CubesAt<R>,
    ) -> Arc<Made<R>> {
        let with = self.made_with(params);
        let before = match self.known(atlas, &with) {
            Known::Same(levels) => return levels,
            Known::Other(levels) => Arc::unwrap_or_clone(levels),
            Known::Nothing => Made::new(atlas.covered()),
        };
        // Nothing is locked meanwhile: a thread that waits for others may come here again.
        self.count.fetch_add(1, Ordering::Relaxed);
        let reads = self.program.passes.iter().any(|pass| !pass.steps.resources().is_empty());
        let cubes = if reads { cubes() } else { CubesAt::dark(|x| R::from(x)) };
        let levels = Arc::new(self.make_again(before, atlas, params, &cubes, false));
        let made = Last { atlas: Arc::clone(atlas), with, levels: Arc::clone(&levels) };
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.retain(|made| !Arc::ptr_eq(&made.atlas, atlas));
        last.push(made);
        levels
    }

    /// Take the levels of an atlas that were made last. Those of an atlas that nobody else has any more, such as an earlier
    /// frame's, go.
    fn known(&self, atlas: &Arc<Atlas>, with: &[f64]) -> Known<R> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.retain(|made| Arc::strong_count(&made.atlas) > 1);
        match last.iter().position(|made| Arc::ptr_eq(&made.atlas, atlas)) {
            Some(at) if last[at].with == with => Known::Same(Arc::clone(&last[at].levels)),
            Some(at) => Known::Other(last.swap_remove(at).levels),
            None => Known::Nothing,
        }
    }

    /// Every level, those between with them.
    #[must_use]
    pub fn make(&self, atlas: &Atlas, params: &Params, cubes: &CubesAt<R>) -> Made<R> {
        self.make_again(Made::new(atlas.covered()), atlas, params, cubes, true)
    }
}

/// What is known of an atlas' levels.
enum Known<R> {
    /// They were made with the same numbers.
    Same(Arc<Made<R>>),
    /// With others.
    Other(Arc<Made<R>>),
    Nothing,
}
