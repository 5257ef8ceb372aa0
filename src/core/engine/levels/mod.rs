//! Levels of the UV atlas over stored texels: what draws and blurs leave, and what samples look up of it.
//!
//! The renderer draws the same passes on an adapter. Here their rules run as samples' do, operation by operation in f32
//! (for the engine) or f64 (for what is exact); which texels a blur or a lookup weighs is that of
//! `shader/atlas/blur.wgsl`, `blur_tangent.wgsl` and `level.wgsl`. Texel by texel, so nothing depends on threads.
//!
//! - this module: [`LevelMaker`], which makes levels anew when a number changes that they are made with
//! - `blur`: one direction of a blur, and how it moves; `neighbours`: how far these lie apart; `look_up`: what samples find

mod blur;
mod look_up;
mod neighbours;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use fearless_simd::Level as Instructions;
use rayon::prelude::*;

use self::blur::blurred;
use self::neighbours::neighbours;
use super::cubes_at::{CubesAt, Sixteen};
use crate::bake::stacks::Stack;
use crate::model::batch::Batch;
use crate::model::effects::Effects;
use crate::model::params::Params;
use crate::model::real::Real;
use crate::program::graph::Input;
use crate::program::levels::{APART_FIELD, LevelPass, LevelProgram};
use crate::program::shading::constant;
use crate::program::steps::Setting;
use crate::samples::{Atlas, LANES, ViewSamples};
use crate::shader::PlanError;
use crate::with_simd;

/// Records of texels that a thread takes at once.
const CHUNK: usize = 64;

/// What levels are made of: f32 or f64.
pub trait Number: Real<Texel = Self, Wide = Self, Mask = bool> + From<f32> + Into<f64> + Send + Sync {}
impl Number for f32 {}
impl Number for f64 {}

/// A number of up to three components.
type Texel<R> = [R; 3];

/// Levels by their names: a value for each covered texel, in the atlas' order; of fewer than three components, 0 after.
pub type Levels<R> = BTreeMap<String, Vec<[R; 3]>>;

/// Makes the levels of a plan's passes.
#[derive(Debug)]
pub struct LevelMaker<R> {
    program: LevelProgram,
    /// The numbers that texels share, for each pass.
    constants: Vec<Input>,
    /// Stacks of cubes that a pass looks up.
    stacks: Vec<Stack>,
    last: Mutex<Vec<Made<R>>>,
    count: AtomicU64,
}

/// Levels, and what they were made with.
#[derive(Debug)]
struct Made<R> {
    atlas: Arc<Atlas>,
    with: Vec<f64>,
    levels: Arc<Levels<R>>,
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

    /// The levels of an atlas that samples look up, at `params`: the last ones, where nothing has changed that they are
    /// made with. `cubes` gives the cubes at `params`.
    pub fn levels(
        &self,
        atlas: &Arc<Atlas>,
        params: &Params,
        cubes: impl FnOnce() -> CubesAt<R>,
    ) -> Arc<Levels<R>> {
        let with = self.made_with(params);
        if let Some(levels) = self.known(atlas, &with) {
            return levels;
        }
        // Nothing is locked meanwhile: a thread that waits for others may come here again.
        self.count.fetch_add(1, Ordering::Relaxed);
        let reads = self.program.passes.iter().any(|pass| !pass.steps.resources().is_empty());
        let cubes = if reads { cubes() } else { CubesAt::dark(|x| R::from(x)) };
        let mut levels = self.make(atlas, params, &cubes);
        levels.retain(|name, _| self.program.looked_up.iter().any(|(found, _)| found == name));
        let levels = Arc::new(levels);
        let made = Made { atlas: Arc::clone(atlas), with, levels: Arc::clone(&levels) };
        self.last.lock().unwrap_or_else(PoisonError::into_inner).push(made);
        levels
    }

    /// Levels that were made with the same numbers. Others go, and those of an atlas that nobody else has any more, such
    /// as an earlier frame's.
    fn known(&self, atlas: &Arc<Atlas>, with: &[f64]) -> Option<Arc<Levels<R>>> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.retain(|made| made.with == with && Arc::strong_count(&made.atlas) > 1);
        let made = last.iter().find(|made| Arc::ptr_eq(&made.atlas, atlas))?;
        Some(Arc::clone(&made.levels))
    }

    /// Every level, those between with them.
    #[must_use]
    pub fn make(&self, atlas: &Atlas, params: &Params, cubes: &CubesAt<R>) -> Levels<R> {
        let like = Batch([R::from(0.0); LANES]);
        let mut levels = Levels::new();
        for pass in &self.program.passes {
            let value = |input: &Input| constant(input, params).unwrap_or(0.0);
            let shared = pass.steps.setting(like, value, |name| cubes.named(name));
            let apart = pass.neighbours.as_ref().and_then(|source| levels.get(source));
            let apart = apart.map_or_else(Vec::new, |source| neighbours(atlas, source));
            let run = Run { pass, atlas, shared, like, loads: loads(pass, atlas, &levels, &apart) };
            let left = match &pass.blur {
                None => run.each(|_, numbers, lane| run.leaves(numbers, lane)),
                Some(blur) => {
                    let Some(source) = levels.get(&blur.source) else { continue };
                    let moved = blur.moving.as_ref().map(|moved| moved.as_ref().and_then(|m| levels.get(m)));
                    let moved = moved.map(|moved| moved.map(Vec::as_slice));
                    run.each(|at, numbers, lane| {
                        vec![blurred(blur, atlas, at, (source, moved), |i| numbers[i].0[lane])]
                    })
                }
            };
            levels.extend(pass.leaves.iter().map(|(name, _)| name.clone()).zip(left));
        }
        levels
    }
}

/// Where a pass reads one of its fields.
enum Load<'a, R> {
    /// A row of the texels' records.
    Row(usize),
    /// A component of a level.
    Level(&'a [Texel<R>], usize),
    /// Nothing is there.
    Nothing,
}

/// Where a pass reads its fields; `apart` is how far each texel's neighbours lie apart, where the pass is over these.
fn loads<'a, R: Number>(
    pass: &LevelPass,
    atlas: &Atlas,
    levels: &'a Levels<R>,
    apart: &'a [Texel<R>],
) -> Vec<Load<'a, R>> {
    let load = |input: &Input| match (levels.get(&input.name), atlas.row(input)) {
        _ if pass.neighbours.is_some() && input.name == APART_FIELD => Load::Level(apart, input.component),
        (Some(level), _) => Load::Level(level, input.component),
        (None, Some(row)) => Load::Row(row),
        (None, None) => Load::Nothing,
    };
    pass.steps.fields().iter().map(load).collect()
}

/// A pass over an atlas.
struct Run<'a, R: Number> {
    pass: &'a LevelPass,
    atlas: &'a Atlas,
    shared: Setting<'a, Sixteen<R>>,
    like: Sixteen<R>,
    loads: Vec<Load<'a, R>>,
}

impl<R: Number> Run<'_, R> {
    /// For each of the pass' leaves its texels: `then` makes them of a texel's place and what the steps yield in a lane.
    fn each(&self, then: impl Fn(usize, &[Sixteen<R>], usize) -> Vec<Texel<R>> + Sync) -> Vec<Vec<Texel<R>>> {
        let covered = self.atlas.covered();
        let chunks = (0..covered.div_ceil(CHUNK * LANES)).into_par_iter();
        let instructions = Instructions::new();
        let made: Vec<Vec<Vec<Texel<R>>>> = chunks
            .map_init(Vec::new, |registers, chunk| {
                let texels = chunk * CHUNK * LANES..covered.min((chunk + 1) * CHUNK * LANES);
                let mut left = vec![Vec::with_capacity(texels.len()); self.pass.leaves.len()];
                let mut numbers = Vec::new();
                for first in texels.clone().step_by(LANES) {
                    numbers.clear();
                    // The same numbers with any instructions: nothing is fused, and lanes do not meet.
                    with_simd!(instructions, simd => {
                        let _ = simd;
                        self.pass.steps.run(&self.shared, self.like, registers, |at| self.field(at, first));
                        numbers.extend(self.pass.steps.outputs(&self.shared, registers));
                    });
                    for lane in 0..LANES.min(texels.end - first) {
                        let texels = then(first + lane, &numbers, lane);
                        left.iter_mut().zip(texels).for_each(|(left, texel)| left.push(texel));
                    }
                }
                left
            })
            .collect();
        let mut left = vec![Vec::with_capacity(covered); self.pass.leaves.len()];
        for chunk in made {
            left.iter_mut().zip(chunk).for_each(|(left, texels)| left.extend(texels));
        }
        left
    }

    /// A field of sixteen texels.
    #[inline(always)]
    fn field(&self, at: usize, first: usize) -> Sixteen<R> {
        match &self.loads[at] {
            Load::Row(row) => Batch(self.atlas.rows().record(first / LANES)[*row].map(R::from)),
            Load::Level(level, component) => {
                Batch(std::array::from_fn(|lane| level[(first + lane).min(level.len() - 1)][*component]))
            }
            Load::Nothing => self.like,
        }
    }

    /// What a draw leaves of a texel.
    fn leaves(&self, numbers: &[Sixteen<R>], lane: usize) -> Vec<Texel<R>> {
        let mut numbers = numbers.iter().map(|number| number.0[lane]);
        let mut leaf = |count: usize| -> Texel<R> {
            std::array::from_fn(|c| {
                numbers.by_ref().take(usize::from(c < count)).next().unwrap_or(self.like.0[0])
            })
        };
        self.pass.leaves.iter().map(|(_, count)| leaf(*count)).collect()
    }
}
