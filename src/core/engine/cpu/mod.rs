//! The engine on the processor: loss, gradient and normal equations of what the planner chose.
//!
//! The planner's rules for stored samples, their tangents and the loss become tapes ([`crate::program`]): one that
//! makes what is kept, and one for each kind of pass. Samples are cut into chunks of a fixed number of groups. Within a
//! chunk products are summed in f32 lanes (at most 64 terms a lane), then folded to f64; the chunks' sums are added
//! pairwise in their order. So the order of additions never depends on threads, and the rounding error stays that of
//! short sums however many samples there are.
//!
//! - `pass`: what a pass computes, as tapes
//! - `ahead`: plans whose tapes are compiled ahead; `block`: what their functions read
//! - `code`: other tapes as the code of a machine that has an accumulator; `machine`: that machine, on SIMD
//! - `view_pass`: a view's blocks of records, from tapes' outputs to sums
//! - `lobe`: the specular cube of the last exponent
//! - `sums`: the sums of a chunk, and the fixed tree that adds chunks

mod ahead;
mod block;
mod code;
mod lobe;
mod machine;
mod pass;
mod sums;
mod view_pass;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use fearless_simd::Level;
use rayon::prelude::*;

use self::block::neutral_rows;
use self::lobe::Lobe;
use self::machine::{BATCH, Bound, File, Stream};
use self::pass::{Fitted, Pass, Reading};
use self::sums::{CHUNK, Sums, Wish, by_chunk, pairwise};
use self::view_pass::{Beside, ViewPass, streams, with_scratch};
use super::gram::pair;
use super::pulls::{Gathered, Pulls};
use super::rules::CubesAt;
use super::view::ObservedView;
use super::{BLOCK, Engine, EngineError, NormalEquations, Objective, Point, Task, Unknown};
use crate::bake::Illumination;
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
    lobe: Mutex<Option<Arc<Lobe>>>,
    kept: Mutex<Option<Arc<Kept>>>,
    looked_up: Mutex<Option<Arc<LookedUp>>>,
    /// Why a pass could not be made.
    fault: OnceLock<String>,
}

/// Kept numbers, and what they were made with.
#[derive(Debug)]
struct Kept {
    turned: bool,
    /// The numbers that all samples shared, and the specular cube's exponent.
    made_with: (Vec<f64>, f64),
    /// For each view, rows of each record.
    views: Vec<Vec<Row>>,
}

/// What samples look up of the UV atlas, and what that was made with.
#[derive(Debug)]
struct LookedUp {
    turned: bool,
    made_with: Vec<f64>,
    /// For each view, rows of each record.
    views: Vec<Vec<Row>>,
}

/// What a pass at a point reads beside samples.
struct Ready {
    pass: Arc<Pass>,
    lobe: Option<Arc<Lobe>>,
    looked_up: Option<Arc<LookedUp>>,
    kept: Arc<Kept>,
}

impl Ready {
    fn beside(&self, view: usize) -> Beside<'_> {
        let looked_up = self.looked_up.as_ref().map_or(&[][..], |found| &found.views[view]);
        Beside {
            kept: Stream { rows: &self.kept.views[view], stride: self.pass.kept },
            levels: Stream { rows: looked_up, stride: self.pass.levels.rows() },
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
            lobe: Mutex::default(),
            kept: Mutex::default(),
            looked_up: Mutex::default(),
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
        (self.lobe, self.kept) = (Mutex::default(), Mutex::default());
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
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let looked_up = self.looked_up(&pass, turned, point);
        let kept = self.kept(&pass, turned, point, lobe.as_deref());
        Ok(Ready { pass, lobe, looked_up, kept })
    }

    /// What samples look up of the UV atlas, made again where a number differs that it is made with; `None` where nothing
    /// is computed there.
    fn looked_up(&self, pass: &Pass, turned: bool, point: &Point) -> Option<Arc<LookedUp>> {
        if pass.levels.rows() == 0 {
            return None;
        }
        let made_with = pass.levels.made_with(&point.params);
        let mut slot = self.looked_up.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |found: &&Arc<LookedUp>| found.turned == turned && found.made_with == made_with;
        if let Some(found) = slot.as_ref().filter(same) {
            return Some(Arc::clone(found));
        }
        let params = &point.params;
        let cubes = || CubesAt::new(&self.illumination, params, |x| x);
        let views = self.views.iter().map(|view| pass.levels.look_up(&view.samples, params, cubes, Row::of));
        let found = Arc::new(LookedUp { turned, views: views.collect(), made_with });
        *slot = Some(Arc::clone(&found));
        Some(found)
    }

    /// How often levels of the UV atlas were made: once for as long as nothing changes that moves them.
    #[must_use]
    pub fn levels_made(&self) -> u64 {
        let passes = self.passes.lock().unwrap_or_else(PoisonError::into_inner);
        passes.values().map(|pass| pass.levels.count()).sum()
    }

    fn lobe(&self, exponent: f64) -> Option<Arc<Lobe>> {
        let mut slot = self.lobe.lock().unwrap_or_else(PoisonError::into_inner);
        Lobe::at(self.illumination.lobes.as_ref()?, exponent, &mut slot)
    }

    /// A tape with what is the same for all records of a pass.
    fn bound<'a>(&'a self, reading: &'a Reading, point: &Point, lobe: Option<&'a Lobe>) -> Bound<'a> {
        let uniforms = reading.uniforms(&point.params).into_iter().map(|x| x as f32).collect();
        let cubes = reading
            .program
            .tape
            .resources
            .iter()
            .map(|name| self.cube(name, lobe).unwrap_or(&self.dark))
            .collect();
        Bound { program: &reading.program, level: self.level, loads: &reading.loads, cubes, uniforms }
    }

    fn cube<'a>(&'a self, name: &str, lobe: Option<&'a Lobe>) -> Option<&'a Cube<f32>> {
        match name {
            "irradiance_faces" => self.illumination.irradiance.as_ref(),
            "hilite_faces" => self.illumination.hilite.as_ref(),
            "specular_faces" => lobe.map(|lobe| &lobe.cube),
            "specular_slope_faces" => lobe.map(|lobe| &lobe.slope),
            _ => None,
        }
    }

    /// What no free parameter changes, made on the first pass, and again should a held parameter differ.
    fn kept(&self, pass: &Pass, turned: bool, point: &Point, lobe: Option<&Lobe>) -> Arc<Kept> {
        let exponent = pass.keep.program.tape.resources.iter().any(|name| name.starts_with("specular"));
        let exponent = if exponent { point.params.scalar(Param::SpecularLobe) } else { 0.0 };
        let made_with = (pass.keep.uniforms(&point.params), exponent);
        let mut slot = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = slot.as_ref().filter(|kept| kept.turned == turned && kept.made_with == made_with)
        {
            return Arc::clone(kept);
        }
        let views = (0..self.views.len()).map(|view| self.make_kept(pass, point, view, lobe)).collect();
        let kept = Arc::new(Kept { turned, made_with, views });
        *slot = Some(Arc::clone(&kept));
        kept
    }

    fn make_kept(&self, pass: &Pass, point: &Point, view: usize, lobe: Option<&Lobe>) -> Vec<Row> {
        let (stride, observed) = (pass.kept, &self.views[view]);
        let records = observed.samples.records();
        let mut kept = vec![Row::ZERO; records * stride];
        if stride == 0 {
            return kept;
        }
        let bound = self.bound(&pass.keep, point, lobe);
        let none = Stream { rows: &[], stride: 0 };
        let streams = streams(observed, Beside { kept: none, levels: none }, &self.neutral);
        let size = BLOCK * CHUNK;
        kept.par_chunks_mut(stride * size).enumerate().for_each_init(File::default, |file, (chunk, rows)| {
            file.prepare(&bound);
            with_simd!(self.level, simd => {
                for (k, rows) in rows.chunks_mut(stride * BATCH).enumerate() {
                    let count = rows.len() / stride;
                    machine::run(simd, &bound, file, &streams, chunk * size + k * BATCH, count);
                    for (output, column) in file.columns().iter().enumerate() {
                        for i in 0..count {
                            rows[i * stride + output] = column[i].get();
                        }
                    }
                }
            });
        });
        kept
    }

    /// What the blocks of a view read in a pass over one of the tapes, of whose outputs `read` are wanted.
    fn view_pass<'a>(
        &'a self,
        (reading, read): (&'a Reading, &'a [usize]),
        ready: &'a Ready,
        point: &Point,
        view: usize,
    ) -> ViewPass<'a> {
        ViewPass {
            view: &self.views[view],
            streams: streams(&self.views[view], ready.beside(view), &self.neutral),
            bound: self.bound(reading, point, ready.lobe.as_deref()),
            read,
            loss: self.loss,
            gain: point.gains.get(view).copied().unwrap_or(1.0) as f32,
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

    fn pass(&self, point: &Point, wish: Wish) -> NormalEquations {
        let channels = self.fitted.channels;
        let k = self.fitted.unknowns.len();
        let mut total = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: self.weight(),
            count: self.weight.1 * channels as u64,
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        let Ok(ready) = self.ready(point) else {
            total.loss = f64::NAN;
            return total;
        };
        let pass = &*ready.pass;
        let every: Vec<usize> = (0..channels).collect();
        let of = if wish == Wish::Loss { (&pass.value, &every[..]) } else { (&pass.moved, &pass.read[..]) };
        for view in 0..self.views.len() {
            let of_view = self.view_pass(of, &ready, point, view);
            let blocks: Vec<usize> = self.read_blocks(&self.views[view]).collect();
            let sums: Vec<Sums> = blocks
                .par_chunks(CHUNK)
                .map(|blocks| {
                    with_scratch(&of_view, |scratch| {
                        with_simd!(self.level, simd => {
                            of_view.chunk(simd, &pass.channels, blocks, wish, scratch)
                        })
                    })
                })
                .collect();
            self.add(view, pass, &pairwise(sums), wish, &mut total);
        }
        if total.weight > 0.0 {
            total.loss /= total.weight;
        }
        total
    }

    /// A pass that keeps the tiles of the images apart.
    fn tiled_pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        let ready = self.ready(point).ok()?;
        let pass = &*ready.pass;
        let mut pulls = Pulls::default();
        for (index, (view, &width)) in self.views.iter().zip(widths).enumerate() {
            let of_view = self.view_pass((&pass.moved, &pass.read), &ready, point, index);
            let own = self.fitted.unknowns.iter().position(|u| *u == Unknown::Gain(index));
            let columns: Vec<Vec<Option<usize>>> =
                pass.channels.iter().map(|c| c.unknowns.iter().map(|u| u.or(own)).collect()).collect();
            let groups = view.samples.groups();
            let blocks: Vec<usize> = self.read_blocks(view).collect();
            let parts = blocks.par_iter().map(|&block| {
                let mut gathered = Gathered::new(view, width, &columns, self.fitted.unknowns.len());
                let end = groups.min((block + 1) * BLOCK);
                with_scratch(&of_view, |scratch| {
                    for first in (block * BLOCK..end).step_by(BATCH) {
                        let count = BATCH.min(end - first);
                        let channels = &pass.channels;
                        with_simd!(self.level, simd => of_view.residuals(simd, channels, scratch, first, count));
                        for i in 0..count {
                            gathered.add(first + i, |c, column| of_view.row(scratch, &channels[c], (c, column), i));
                        }
                    }
                });
                gathered
            });
            let parts: Vec<Gathered<'_>> = parts.collect();
            pulls.add_view(index, width, parts);
        }
        Some(pulls)
    }

    /// One view's packed sums into the full matrices.
    fn add(&self, view: usize, pass: &Pass, sums: &Sums, wish: Wish, total: &mut NormalEquations) {
        let Some(loss) = sums.0.last() else { return };
        total.loss += loss;
        let k = self.fitted.unknowns.len();
        let gain = self.fitted.unknowns.iter().position(|u| *u == Unknown::Gain(view));
        let mut base = 0;
        for channel in pass.channels.iter().filter(|_| wish != Wish::Loss) {
            let (columns, count) = (channel.unknowns.len(), channel.unknowns.len() + 1);
            let unknown: Vec<Option<usize>> = channel.unknowns.iter().map(|u| u.or(gain)).collect();
            // Of a gradient there is the last column alone.
            let entry = |i: usize, j: usize| if wish == Wish::Gradient { i } else { pair(i, j, count) };
            for i in 0..columns {
                let Some(a) = unknown[i] else { continue };
                total.jtr[a] += sums.0[base + entry(i, columns)];
                for j in (i..columns).filter(|_| wish == Wish::Normal) {
                    let Some(b) = unknown[j] else { continue };
                    let value = sums.0[base + entry(i, j)];
                    total.jtj[a * k + b] += value;
                    if a != b {
                        total.jtj[b * k + a] += value;
                    }
                }
            }
            total.residual += sums.0[base + entry(columns, columns)];
            base += if wish == Wish::Gradient { count } else { count * (count + 1) / 2 };
        }
    }
}

impl Objective for CpuEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.fitted.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.loss == Loss::L2 && self.views.iter().all(|view| view.clip.is_none())
    }

    fn rounding(&self) -> f64 {
        super::rounding(&self.views, self.loss, self.stride)
    }

    fn fault(&self) -> Option<String> {
        self.fault.get().cloned()
    }

    fn pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        if widths.len() == self.views.len() { self.tiled_pulls(point, widths) } else { None }
    }

    fn normal_equations(&self, point: &Point) -> NormalEquations {
        self.pass(point, Wish::Normal)
    }

    fn loss(&self, point: &Point) -> f64 {
        self.pass(point, Wish::Loss).loss
    }

    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        self.pass(point, Wish::Gradient).loss_and_gradient()
    }
}

impl Engine for CpuEngine {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn provenance(&self) -> Vec<(String, String)> {
        vec![
            ("threads".to_owned(), rayon::current_num_threads().to_string()),
            ("instructions".to_owned(), crate::simd::instructions()),
        ]
    }

    fn views(&self) -> &Arc<[ObservedView]> {
        self.views()
    }

    fn surfaced_views(&self) -> Result<Arc<[ObservedView]>, EngineError> {
        Ok(Arc::clone(&self.views))
    }

    fn samples(&self) -> u64 {
        self.samples()
    }

    fn weight(&self) -> f64 {
        self.weight.0 * self.fitted.channels as f64
    }

    fn set_stride(&mut self, stride: usize) {
        self.set_stride(stride);
    }
}
