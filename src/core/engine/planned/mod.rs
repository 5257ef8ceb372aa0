//! The engine on the processor: loss, gradient and normal equations of what the planner chose.
//!
//! The planner's rules for stored samples, their tangents and the loss become tapes ([`crate::program`]): one that
//! makes what is kept, and one for each kind of pass. Samples are cut into chunks of a fixed number of groups. Within a
//! chunk products are summed in f32 lanes (at most 64 terms a lane), then folded to f64; the chunks' sums are added
//! pairwise in their order. So the order of additions never depends on threads, and the rounding error stays that of
//! short sums however many samples there are.
//!
//! - `pass`: what a pass computes, as tapes
//! - `code`: tapes as the code of a machine that has an accumulator
//! - `machine`: that machine, over blocks of records, on SIMD
//! - `lobe`: the specular cube of the last exponent
//! - `sums`: the sums of a chunk, and the fixed tree that adds chunks

mod code;
mod lobe;
mod machine;
mod pass;
mod sums;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use fearless_simd::Level;
use rayon::prelude::*;

use self::lobe::Lobe;
use self::machine::{BATCH, Bound, Column, File, FileColumns, Stream};
use self::pass::{CLIP_HIGH, CLIP_LOW, Fitted, GAIN, Pass, Reading, Stages, Written};
use self::sums::{CHUNK, Sums, Wish, by_chunk, fold, pairwise};
use super::gram::{add_gram, add_last, pair};
use super::lanes::Lanes;
use super::pulls::{Gathered, Pulls};
use super::view::ObservedView;
use super::{BLOCK, NormalEquations, Objective, Point, Unknown};
use crate::bake::Illumination;
use crate::model::cube::Cube;
use crate::model::evaluate::Setup;
use crate::model::params::Param;
use crate::program::graph::Input;
use crate::program::shading::{ShadingError, constant};
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::scene::Loss;
use crate::simd::Simd;
use crate::with_simd;

/// Loss, gradient and normal equations on the CPU, of whatever rules the planner chose.
#[derive(Debug)]
pub struct PlannedEngine {
    illumination: Illumination,
    views: Vec<ObservedView>,
    fitted: Fitted,
    level: Level,
    stride: usize,
    weight: (f64, u64),
    passes: Mutex<BTreeMap<Written, Arc<Pass>>>,
    lobe: Mutex<Option<Arc<Lobe>>>,
    kept: Mutex<Option<Arc<Kept>>>,
    /// Why a pass could not be made.
    fault: OnceLock<String>,
}

/// Kept numbers, and what they were made with.
#[derive(Debug)]
struct Kept {
    written: Written,
    /// The numbers that all samples shared, and the specular cube's exponent.
    made_with: (Vec<f64>, f64),
    /// For each view, rows of each record.
    views: Vec<Vec<Row>>,
}

/// What the blocks of a view read in one pass.
struct ViewPass<'a> {
    view: &'a ObservedView,
    streams: [Stream<'a>; 5],
    sample: Option<Bound<'a>>,
    pixel: Bound<'a>,
    /// Sums a pixel.
    sums: usize,
}

/// What a thread computes in.
#[derive(Default)]
struct Scratch {
    pixel: File,
    samples: SampleScratch,
    sums: Vec<Row>,
}

/// What a thread adds samples up in.
#[derive(Default)]
struct SampleScratch {
    file: File,
    /// Sums over a pixel's samples, of [`BATCH`] groups.
    pixels: Vec<Row>,
}

impl PlannedEngine {
    /// An engine over `views` for the `unknowns`.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn new(
        setup: Setup,
        illumination: Illumination,
        views: Vec<ObservedView>,
        loss: Loss,
        unknowns: Vec<Unknown>,
    ) -> Result<Self, ShadingError> {
        Self::with_kept_terms(setup, illumination, views, loss, unknowns, true)
    }

    /// As [`Self::new`]; with `keep` false every number is computed anew in each pass.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn with_kept_terms(
        setup: Setup,
        illumination: Illumination,
        views: Vec<ObservedView>,
        loss: Loss,
        unknowns: Vec<Unknown>,
        keep: bool,
    ) -> Result<Self, ShadingError> {
        let mut fitted = Fitted::new(setup, unknowns, loss, &views);
        fitted.keep = keep;
        fitted.faces = super::face_sizes(&illumination);
        let mut engine = Self {
            illumination,
            views,
            fitted,
            level: Level::new(),
            stride: 1,
            weight: (0.0, 0),
            passes: Mutex::default(),
            lobe: Mutex::default(),
            kept: Mutex::default(),
            fault: OnceLock::new(),
        };
        engine.set_stride(1);
        // What cannot be computed shows here, and not in the midst of a fit.
        engine.pass_for(Written { turned: false, gained: false })?;
        engine.pass_for(Written { turned: true, gained: true })?;
        Ok(engine)
    }

    /// Let each pass read only every `stride`-th block of pixels: a coarse fit on a fraction of them.
    pub fn set_stride(&mut self, stride: usize) {
        self.stride = stride.max(1);
        self.weight = (0.0, 0);
        for view in &self.views {
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
    pub fn views(&self) -> &[ObservedView] {
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

    fn written(&self, point: &Point) -> Written {
        let turns = |u: &Unknown| matches!(u, Unknown::Param(c) if c.param == Param::EnvironmentRotation);
        let gains = |u: &Unknown| matches!(u, Unknown::Gain(_));
        let unknowns = &self.fitted.unknowns;
        Written {
            turned: point.params.scalar(Param::EnvironmentRotation) != 0.0 || unknowns.iter().any(turns),
            gained: point.gains.iter().any(|gain| *gain != 1.0) || unknowns.iter().any(gains),
        }
    }

    fn pass_for(&self, written: Written) -> Result<Arc<Pass>, ShadingError> {
        let mut passes = self.passes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pass) = passes.get(&written) {
            return Ok(Arc::clone(pass));
        }
        let pass = Pass::new(&self.fitted, written);
        let pass = Arc::new(pass.inspect_err(|error| drop(self.fault.set(error.to_string())))?);
        passes.insert(written, Arc::clone(&pass));
        Ok(pass)
    }

    fn lobe(&self, exponent: f64) -> Option<Arc<Lobe>> {
        let mut slot = self.lobe.lock().unwrap_or_else(PoisonError::into_inner);
        Lobe::at(self.illumination.lobes.as_ref()?, exponent, &mut slot)
    }

    /// A tape with what is the same for all records of a view in a pass.
    fn bound<'a>(
        &'a self,
        reading: &'a Reading,
        point: &Point,
        view: usize,
        lobe: Option<&'a Lobe>,
    ) -> Bound<'a> {
        let clip = self.views.get(view).and_then(|view| view.clip);
        let value = |input: &Input| match input.name.as_str() {
            GAIN => point.gains.get(view).copied().unwrap_or(1.0),
            CLIP_LOW => clip.map_or(f64::NEG_INFINITY, |clip| clip.low.into()),
            CLIP_HIGH => clip.map_or(f64::INFINITY, |clip| clip.high.into()),
            _ => constant(input, &point.params).unwrap_or(0.0),
        };
        let uniforms = reading.program.tape.uniform_values(value).into_iter().map(|x| x as f32).collect();
        let cubes = reading.program.tape.resources.iter().filter_map(|name| self.cube(name, lobe)).collect();
        Bound { program: &reading.program, loads: &reading.loads, cubes, uniforms }
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
    fn kept(&self, pass: &Pass, written: Written, point: &Point, lobe: Option<&Lobe>) -> Arc<Kept> {
        let shared = |input: &Input| constant(input, &point.params).unwrap_or(0.0);
        let exponent = pass.keep.program.tape.resources.iter().any(|name| name.starts_with("specular"));
        let exponent = if exponent { point.params.scalar(Param::SpecularLobe) } else { 0.0 };
        let made_with = (pass.keep.program.tape.uniform_values(shared), exponent);
        let mut slot = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) =
            slot.as_ref().filter(|kept| kept.written == written && kept.made_with == made_with)
        {
            return Arc::clone(kept);
        }
        let views = (0..self.views.len()).map(|view| self.make_kept(pass, point, view, lobe)).collect();
        let kept = Arc::new(Kept { written, made_with, views });
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
        let bound = self.bound(&pass.keep, point, view, lobe);
        let streams = streams(observed, &[], 0, &[], 0);
        let size = BLOCK * CHUNK;
        kept.par_chunks_mut(stride * size).enumerate().for_each_init(File::default, |file, (chunk, rows)| {
            file.prepare(&bound);
            with_simd!(self.level, simd => {
                for (k, rows) in rows.chunks_mut(stride * BATCH).enumerate() {
                    let count = rows.len() / stride;
                    machine::run(simd, &bound, file, &streams, chunk * size + k * BATCH, count);
                    for output in 0..stride {
                        let column = file.column(output);
                        for i in 0..count {
                            rows[i * stride + output] = column[i].get();
                        }
                    }
                }
            });
        });
        kept
    }

    fn view_pass<'a>(
        &'a self,
        stages: &'a Stages,
        kept: &'a [Row],
        stride: usize,
        point: &Point,
        view: usize,
        lobe: Option<&'a Lobe>,
    ) -> ViewPass<'a> {
        let sample = stages.sample.as_ref().map(|reading| self.bound(reading, point, view, lobe));
        ViewPass {
            view: &self.views[view],
            streams: streams(&self.views[view], kept, stride, &[], 0),
            sums: sample.as_ref().map_or(0, |bound| bound.program.tape.outputs.len()),
            sample,
            pixel: self.bound(&stages.pixel, point, view, lobe),
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
        let written = self.written(point);
        let Ok(pass) = self.pass_for(written) else { return };
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&pass, written, point, lobe.as_deref());
        let kept = &kept.views[index];
        let of_view = self.view_pass(&pass.image, kept, pass.kept, point, index, lobe.as_deref());
        self.shade(&of_view, planes);
    }

    /// The outputs of every pixel, a plane each.
    fn shade(&self, of_view: &ViewPass<'_>, planes: &mut Vec<Vec<f32>>) {
        let groups = of_view.view.samples.groups();
        planes.resize_with(of_view.pixel.program.tape.outputs.len(), Vec::new);
        planes.iter_mut().for_each(|plane| plane.resize(groups * LANES, 0.0));
        by_chunk(planes).par_iter_mut().enumerate().for_each_init(Scratch::default, |scratch, (chunk, parts)| {
            scratch.prepare(of_view);
            let first = chunk * BLOCK * CHUNK;
            let end = groups.min(first + BLOCK * CHUNK);
            with_simd!(self.level, simd => {
                for start in (first..end).step_by(BATCH) {
                    let count = BATCH.min(end - start);
                    of_view.block(simd, &scratch.pixel, &mut scratch.samples, start, count);
                    for (output, part) in parts.iter_mut().enumerate() {
                        let column = scratch.pixel.column(output);
                        for i in 0..count {
                            part[(start - first + i) * LANES..][..LANES].copy_from_slice(&*column[i].get());
                        }
                    }
                }
            });
        });
    }

    fn pass(&self, point: &Point, wish: Wish) -> NormalEquations {
        let channels = self.fitted.channels;
        let k = self.fitted.unknowns.len();
        let mut total = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: self.weight.0 * channels as f64,
            count: self.weight.1 * channels as u64,
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        let written = self.written(point);
        let Ok(pass) = self.pass_for(written) else {
            total.loss = f64::NAN;
            return total;
        };
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&pass, written, point, lobe.as_deref());
        let stages = if wish == Wish::Loss { &pass.loss } else { &pass.normal };
        for view in 0..self.views.len() {
            let of_view = self.view_pass(stages, &kept.views[view], pass.kept, point, view, lobe.as_deref());
            let blocks: Vec<usize> = self.read_blocks(&self.views[view]).collect();
            let sums: Vec<Sums> = blocks
                .par_chunks(CHUNK)
                .map_init(Scratch::default, |scratch, blocks| {
                    scratch.prepare(&of_view);
                    with_simd!(self.level, simd => of_view.chunk(simd, &pass, blocks, wish, scratch))
                })
                .collect();
            self.add(view, &pass, &pairwise(sums), wish, &mut total);
        }
        if total.weight > 0.0 {
            total.loss /= total.weight;
        }
        total
    }

    /// A pass that keeps the tiles of the images apart.
    fn tiled_pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        let written = self.written(point);
        let pass = self.pass_for(written).ok()?;
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&pass, written, point, lobe.as_deref());
        let mut pulls = Pulls::default();
        for (index, (view, &width)) in self.views.iter().zip(widths).enumerate() {
            let of_view =
                self.view_pass(&pass.normal, &kept.views[index], pass.kept, point, index, lobe.as_deref());
            let own = self.fitted.unknowns.iter().position(|u| *u == Unknown::Gain(index));
            let columns: Vec<Vec<Option<usize>>> =
                pass.channels.iter().map(|c| c.unknowns.iter().map(|u| u.or(own)).collect()).collect();
            let groups = view.samples.groups();
            let blocks: Vec<usize> = self.read_blocks(view).collect();
            let parts = blocks.par_iter().map_init(Scratch::default, |scratch, &block| {
                scratch.prepare(&of_view);
                let mut gathered = Gathered::new(view, width, &columns, self.fitted.unknowns.len());
                let end = groups.min((block + 1) * BLOCK);
                let Scratch { pixel, samples, .. } = scratch;
                let outputs: Vec<Vec<&Column>> = pass
                    .channels
                    .iter()
                    .map(|c| c.outputs.iter().map(|&k| pixel.column(k)).collect())
                    .collect();
                for first in (block * BLOCK..end).step_by(BATCH) {
                    let count = BATCH.min(end - first);
                    with_simd!(self.level, simd => of_view.block(simd, pixel, samples, first, count));
                    for i in 0..count {
                        gathered.add(first + i, |channel, column| outputs[channel][column][i].get());
                    }
                }
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
            let (columns, count) = (channel.unknowns.len(), channel.outputs.len());
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

/// The streams of a view, in the order of `pass::StreamOf`.
fn streams<'a>(
    view: &'a ObservedView,
    kept: &'a [Row],
    kept_stride: usize,
    pixels: &'a [Row],
    sums: usize,
) -> [Stream<'a>; 5] {
    let samples = view.samples.surface.rows();
    [
        Stream { rows: samples.all(), stride: samples.stride() },
        Stream { rows: kept, stride: kept_stride },
        Stream { rows: pixels, stride: sums },
        Stream { rows: view.target.all(), stride: view.target.stride() },
        Stream { rows: &view.weight, stride: 1 },
    ]
}

impl Scratch {
    fn prepare(&mut self, pass: &ViewPass<'_>) {
        if let Some(bound) = &pass.sample {
            self.samples.file.prepare(bound);
        }
        self.pixel.prepare(&pass.pixel);
        self.samples.pixels.resize(pass.sums * BATCH, Row::ZERO);
    }
}

impl ViewPass<'_> {
    /// The outputs of `count` groups from `first` on, in the pixels' file.
    #[inline(always)]
    fn block<S: Simd>(&self, simd: S, file: &File, samples: &mut SampleScratch, first: usize, count: usize) {
        let Some(sample) = &self.sample else {
            machine::run(simd, &self.pixel, file, &self.streams, first, count);
            return;
        };
        self.add_samples(simd, sample, samples, first, count);
        let mut streams = self.streams;
        streams[pass::StreamOf::Pixels as usize] = Stream { rows: &samples.pixels, stride: self.sums };
        // The sums stand from the first group on, the view's streams from their start.
        for at in [pass::StreamOf::Targets as usize, pass::StreamOf::Weights as usize] {
            let Stream { rows, stride } = streams[at];
            streams[at].rows = rows.get(first * stride..).unwrap_or(&[]);
        }
        machine::run(simd, &self.pixel, file, &streams, 0, count);
    }

    /// Add up the samples of each pixel, by their shares.
    #[inline(always)]
    fn add_samples<S: Simd>(
        &self,
        simd: S,
        sample: &Bound<'_>,
        scratch: &mut SampleScratch,
        first: usize,
        count: usize,
    ) {
        let surface = &self.view.samples.surface;
        let starts = &self.view.samples.group_start;
        scratch.pixels.fill(Row::ZERO);
        let (mut record, end) = (starts[first] as usize, starts[first + count] as usize);
        let mut group = first;
        while record < end {
            let block = BATCH.min(end - record);
            machine::run(simd, sample, &scratch.file, &self.streams, record, block);
            for i in 0..block {
                while starts[group + 1] as usize <= record + i {
                    group += 1;
                }
                let share = match surface.places().weight {
                    Some(at) => Lanes::of_row(simd, &surface.rows().record(record + i)[at]),
                    None => Lanes::splat(simd, 1.0),
                };
                let sums = &mut scratch.pixels[(group - first) * self.sums..][..self.sums];
                for (output, sum) in sums.iter_mut().enumerate() {
                    use crate::model::real::Real;
                    let value = Lanes::of_row(simd, &scratch.file.column(output)[i].get());
                    share.mul_add(value, Lanes::of_row(simd, sum)).store(sum);
                }
            }
            record += block;
        }
    }

    /// The sums over a few blocks.
    #[inline(always)]
    fn chunk<S: Simd>(
        &self,
        simd: S,
        pass: &Pass,
        blocks: &[usize],
        wish: Wish,
        scratch: &mut Scratch,
    ) -> Sums {
        let groups = self.view.samples.groups();
        let size = |channel: &pass::ChannelColumns| match wish {
            Wish::Loss => 0,
            Wish::Gradient => channel.outputs.len(),
            Wish::Normal => channel.outputs.len() * (channel.outputs.len() + 1) / 2,
        };
        let used: usize = pass.channels.iter().map(size).sum();
        let Scratch { pixel, samples, sums } = scratch;
        let file = &*pixel;
        let column = |output: usize| file.column(output);
        let losses = column(0);
        let columns: Vec<Vec<&Column>> = if wish == Wish::Loss {
            Vec::new()
        } else {
            pass.channels.iter().map(|c| c.outputs.iter().map(|&output| column(output)).collect()).collect()
        };
        sums.clear();
        sums.resize(used, Row::ZERO);
        let mut loss = Lanes::splat(simd, 0.0);
        for &block in blocks {
            let end = groups.min((block + 1) * BLOCK);
            let mut first = block * BLOCK;
            while first < end {
                let count = BATCH.min(end - first);
                self.block(simd, file, samples, first, count);
                for row in &losses[..count] {
                    loss = loss + Lanes::of_row(simd, &row.get());
                }
                let mut base = 0;
                for channel in &columns {
                    let source = FileColumns { columns: channel, groups: count };
                    if wish == Wish::Gradient {
                        add_last(simd, source, &mut sums[base..]);
                        base += channel.len();
                    } else {
                        add_gram(simd, source, &mut sums[base..]);
                        base += channel.len() * (channel.len() + 1) / 2;
                    }
                }
                first += count;
            }
        }
        let mut folded: Vec<f64> = sums.iter().map(|row| fold(row)).collect();
        folded.push(fold(&loss.to_array()));
        Sums(folded)
    }
}

impl Objective for PlannedEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.fitted.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.fitted.loss == Loss::L2 && !self.fitted.clipped
    }

    fn rounding(&self) -> f64 {
        super::rounding(&self.views, self.fitted.loss, self.stride)
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
