//! The engine on the processor: loss, gradient and normal equations of what the planner chose.
//!
//! The planner's rules for stored samples, their tangents and the loss become tapes ([`crate::program`]): one that
//! makes what is kept, and one for each kind of pass. Samples are cut into chunks of a fixed number of groups. Within a
//! chunk products are summed in f32 lanes (at most 64 terms a lane), then folded to f64; the chunks' sums are added
//! pairwise in their order. So the order of additions never depends on threads, and the rounding error stays that of
//! short sums however many samples there are.
//!
//! - `fitted`: what is the same for every view of a fit; `pass`: what a pass computes, as tapes
//! - `program`: tapes and what runs them; `streams`: what they read and write
//! - `ahead`: plans whose tapes are compiled ahead; `block`: what their functions read
//! - `code`: other tapes as the code of a machine that has an accumulator; `machine`: that machine, on SIMD; `heavy`: its
//!   operations from memory to memory; `file`: its registers
//! - `kept`: rows that no free parameter changes; `looked_up`: rows of what samples find of the UV atlas
//! - `view_pass`: a view's blocks of records, from tapes' outputs to sums
//! - `lobe`: the cubes of stacks where they were looked up last
//! - `sums`: the sums of a chunk, and the fixed tree that adds chunks; `equations`: those of all views
//! - `objective`: what solvers see

mod ahead;
mod block;
mod code;
mod equations;
mod file;
mod fitted;
mod heavy;
mod kept;
mod lobe;
mod looked_up;
mod machine;
mod objective;
mod pass;
mod program;
mod streams;
mod sums;
mod view_pass;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use fearless_simd::Level;
use rayon::prelude::*;

use self::fitted::Fitted;
use self::kept::Kept;
use self::lobe::Lobes;
use self::looked_up::LookedUp;
use self::pass::{Pass, Reading};
use self::program::Bound;
use self::streams::{Stream, StreamOf, neutral_rows};
use self::sums::{CHUNK, by_chunk};
use self::view_pass::{Beside, ViewPass, streams, with_scratch};
use super::view::ObservedView;
use super::{BLOCK, Point, Task, Unknown};
use crate::bake::Illumination;
use crate::engine::levels::Corners;
use crate::model::cube::Cube;
use crate::model::params::Param;
use crate::program::shading::ShadingError;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::scene::Loss;
use crate::with_simd;

/// Loss, gradient and normal equations on the CPU, of whatever rules the planner chose.
#[derive(Debug)]
pub struct CpuEngine {
    illumination: Arc<Illumination>,
    views: Arc<[ObservedView]>,
    fitted: Fitted,
    loss: Loss,
    level: Level,
    stride: usize,
    weight: (f64, u64),
    /// For an environment that is turned, and for one that is not.
    passes: Mutex<BTreeMap<bool, Arc<Pass>>>,
    /// Rows of what stands in for fields that samples lack.
    neutral: Vec<Row>,
    /// What stands in for a cube that was not baked.
    dark: Cube<f32>,
    lobes: Mutex<Lobes>,
    kept: Mutex<Option<Arc<Kept>>>,
    looked_up: Mutex<Option<Arc<LookedUp>>>,
    /// The texels that each view's samples look up.
    corners: OnceLock<Arc<Vec<Vec<Corners<f32>>>>>,
    /// Why a pass could not be made.
    fault: OnceLock<String>,
}

/// What a pass at a point reads beside samples.
struct Ready {
    pass: Arc<Pass>,
    lobes: Lobes,
    looked_up: Option<Arc<LookedUp>>,
    kept: Arc<Kept>,
}

impl Ready {
    fn beside(&self, view: usize) -> Beside<'_> {
        let (rows, lookup) = self.looked_up.as_ref().map_or((&[][..], None), |found| found.of(view));
        Beside {
            kept: Stream { rows: &self.kept.views[view], stride: self.pass.kept, skipped: 0 },
            levels: Stream { rows, stride: self.pass.levels.rows(), skipped: 0 },
            lookup,
        }
    }
}

impl CpuEngine {
    /// An engine for a task.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn new(task: Task) -> Result<Self, ShadingError> {
        Self::with_kept_terms(task, true)
    }

    /// As [`Self::new`]; with `keep` false every number is computed anew in each pass.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn with_kept_terms(task: Task, keep: bool) -> Result<Self, ShadingError> {
        let Task { setup, illumination, views, loss, unknowns } = task;
        let mut fitted = Fitted::new(setup, unknowns, &views);
        fitted.keep = keep;
        fitted.faces = super::face_sizes(&illumination);
        let stride = views.iter().map(|view| view.samples.surface.rows().stride()).max();
        let mut engine = Self {
            illumination,
            views,
            fitted,
            loss,
            level: Level::new(),
            stride: 1,
            weight: (0.0, 0),
            passes: Mutex::default(),
            neutral: neutral_rows(stride.unwrap_or(0)),
            dark: Cube::from_fn(1, |_, _, _| [0.0; 4]),
            lobes: Mutex::default(),
            kept: Mutex::default(),
            looked_up: Mutex::default(),
            corners: OnceLock::new(),
            fault: OnceLock::new(),
        };
        engine.set_stride(1);
        // What cannot be computed shows here, and not in the midst of a fit.
        if !engine.turns() {
            engine.pass_for(false)?;
        }
        let pass = engine.pass_for(true)?;
        for view in engine.views.iter() {
            pass.levels.check(setup.effects, &view.samples)?;
        }
        Ok(engine)
    }

    /// Let each pass read only every `stride`-th block of pixels: a coarse fit on a fraction of them.
    pub fn set_stride(&mut self, stride: usize) {
        self.stride = stride.max(1);
        self.weight = (0.0, 0);
        for view in self.views.iter() {
            let groups = view.samples.groups();
            let read = self.read_blocks(view).flat_map(|b| b * BLOCK..groups.min((b + 1) * BLOCK));
            let (weight, count) = view.weight_and_count(read);
            self.weight.0 += weight;
            self.weight.1 += count;
        }
    }

    /// Run with the instructions of `level` and not with the best that the processor has: so that one machine can show
    /// what others will compute.
    pub fn set_level(&mut self, level: Level) {
        self.level = level;
        // What was kept was made with other instructions.
        (self.lobes, self.kept) = (Mutex::default(), Mutex::default());
    }

    /// The views.
    #[must_use]
    pub const fn views(&self) -> &Arc<[ObservedView]> {
        &self.views
    }

    /// Surface samples of positive weight, over all views.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.views.iter().map(|view| view.samples.count() as u64).sum()
    }

    /// How many blocks of pixels there are in all views.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.views.iter().map(|view| view.samples.groups().div_ceil(BLOCK)).sum()
    }

    fn read_blocks(&self, view: &ObservedView) -> impl Iterator<Item = usize> + use<> {
        (0..view.samples.groups().div_ceil(BLOCK)).step_by(self.stride)
    }

    /// Whether the environment's rotation is free.
    fn turns(&self) -> bool {
        let turns = |u: &Unknown| matches!(u, Unknown::Param(c) if c.param == Param::EnvironmentRotation);
        self.fitted.unknowns.iter().any(turns)
    }

    fn turned(&self, point: &Point) -> bool {
        point.params.scalar(Param::EnvironmentRotation) != 0.0 || self.turns()
    }

    /// Whether passes at `point` run functions that were compiled ahead.
    #[must_use]
    pub fn is_compiled_ahead(&self, point: &Point) -> bool {
        let is_compiled = |reading: &Reading| {
            let program = &reading.program;
            program.is_compiled(self.level) || program.tape.outputs.is_empty()
        };
        self.pass_for(self.turned(point))
            .is_ok_and(|pass| [&pass.keep, &pass.value, &pass.moved].into_iter().all(is_compiled))
    }

    /// Bytes of a sample that each pass at `point` reads: the numbers that are kept of it, the fields that are not, its
    /// target and what its pixel counts.
    ///
    /// # Errors
    /// When no rules yield what the effects call for.
    pub fn bytes_a_sample(&self, point: &Point) -> Result<usize, ShadingError> {
        let pass = self.pass_for(self.turned(point))?;
        let loads = pass.moved.loads.iter().filter(|(stream, _)| *stream != StreamOf::Neutral).count();
        let observed =
            self.views.iter().map(|view| view.target.stride() + usize::from(!view.weight.is_empty()));
        Ok(size_of::<f32>() * (loads + observed.max().unwrap_or(0)))
    }

    fn pass_for(&self, turned: bool) -> Result<Arc<Pass>, ShadingError> {
        let mut passes = self.passes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pass) = passes.get(&turned) {
            return Ok(Arc::clone(pass));
        }
        let pass = Pass::new(&self.fitted, turned);
        let pass = Arc::new(pass.inspect_err(|error| drop(self.fault.set(error.to_string())))?);
        passes.insert(turned, Arc::clone(&pass));
        Ok(pass)
    }

    /// All that a pass at `point` reads beside samples.
    fn ready(&self, point: &Point) -> Result<Ready, ShadingError> {
        let turned = self.turned(point);
        let pass = self.pass_for(turned)?;
        let lobes = Lobes::at(&self.illumination, &point.params, &self.lobes);
        let looked_up = self.looked_up(&pass, turned, point);
        let kept = self.kept(&pass, turned, point, &lobes);
        Ok(Ready { pass, lobes, looked_up, kept })
    }

    /// A tape with what is the same for all records of a pass.
    fn bound<'a>(&'a self, reading: &'a Reading, point: &Point, lobes: &'a Lobes) -> Bound<'a> {
        let uniforms = reading.uniforms(&point.params).into_iter().map(|x| x as f32).collect();
        let cubes = reading
            .program
            .tape
            .resources
            .iter()
            .map(|name| self.cube(name, lobes).unwrap_or(&self.dark))
            .collect();
        Bound { program: &reading.program, level: self.level, loads: &reading.loads, cubes, uniforms }
    }

    fn cube<'a>(&'a self, name: &str, lobes: &'a Lobes) -> Option<&'a Cube<f32>> {
        match name {
            "irradiance_faces" => self.illumination.irradiance.as_ref(),
            "hilite_faces" => self.illumination.hilite.as_ref(),
            of_stack => lobes.named(of_stack),
        }
    }

    /// What the blocks of a view read in a pass over one of the tapes, of whose outputs `read` are wanted.
    fn view_pass<'a>(
        &'a self,
        (reading, read): (&'a Reading, &'a [usize]),
        ready: &'a Ready,
        point: &Point,
        view: usize,
    ) -> ViewPass<'a> {
        let beside = ready.beside(view);
        ViewPass {
            view: &self.views[view],
            streams: streams(&self.views[view], beside, &self.neutral),
            lookup: beside.lookup,
            bound: self.bound(reading, point, &ready.lobes),
            read,
            loss: self.loss,
            gain: point.gains.get(view).copied().unwrap_or_default().channels().map(|x| x as f32),
        }
    }

    /// The image of view `index` at `point`: for each pixel slot the mean over its visible samples, colour and (where
    /// the haze is compared) alpha, times the view's gain. A plane a channel.
    #[must_use]
    pub fn image(&self, index: usize, point: &Point) -> Vec<Vec<f32>> {
        let mut planes = Vec::new();
        self.image_into(index, point, &mut planes);
        planes
    }

    /// As [`Self::image`], into the planes of an earlier image: memory that is new costs more than the pass.
    pub fn image_into(&self, index: usize, point: &Point, planes: &mut Vec<Vec<f32>>) {
        let Ok(ready) = self.ready(point) else { return };
        let channels: Vec<usize> = (0..self.fitted.channels).collect();
        let of_view = self.view_pass((&ready.pass.value, &channels), &ready, point, index);
        let groups = of_view.view.samples.groups();
        planes.resize_with(channels.len(), Vec::new);
        planes.iter_mut().for_each(|plane| plane.resize(groups * LANES, 0.0));
        by_chunk(planes).par_iter_mut().enumerate().for_each(|(chunk, parts)| {
            let first = chunk * BLOCK * CHUNK;
            let groups = first..groups.min(first + BLOCK * CHUNK);
            with_scratch(&of_view, |scratch| {
                with_simd!(self.level, simd => of_view.shade(simd, scratch, groups, parts));
            });
        });
    }
}
