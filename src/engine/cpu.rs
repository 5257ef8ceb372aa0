//! The CPU engine: all cores, SIMD, and the same sums for any number of threads.
//!
//! Samples are cut into chunks of a fixed number of groups. Within a chunk products are summed in
//! f32 lanes (at most 64 terms a lane), then folded to f64; the chunks' sums are added pairwise in
//! their order. So the order of additions never depends on threads, and the rounding error stays
//! that of short sums however many samples there are.

use std::sync::{Arc, Mutex, PoisonError};

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::gram::{Columns, add_gram, add_last, pair};
use super::kernel::Kernel;
use super::lanes::Lanes;
use super::plan::{ChannelPlan, Plan, WINDOW};
use super::records::{Records, Row};
use super::view::ObservedView;
use super::{NormalEquations, Objective, Point, Unknown};
use crate::bake::LobeStack;
use crate::model::compose::Weights;
use crate::model::cube::Cube;
use crate::model::evaluate::Setup;
use crate::model::fragment::LookupParam;
use crate::model::lights::{Cubes, Lights};
use crate::model::params::{Param, Params};
use crate::samples::LANES;
use crate::scene::Loss;

/// Groups in a block: what the scratch holds at once (it should stay in the nearest caches).
const BLOCK: usize = 8;
/// Blocks in a chunk: one unit of work, and 64 terms a lane.
const CHUNK: usize = 8;

/// The lights of a scene: the cubes that the enabled effects ask for.
#[derive(Clone, Debug, Default)]
pub struct Illumination {
    /// E_d.
    pub irradiance: Option<Cube<f32>>,
    /// E_s over its exponents.
    pub lobes: Option<LobeStack>,
    /// E_h.
    pub hilite: Option<Cube<f32>>,
}

/// What a pass yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wish {
    Loss,
    Gradient,
    Normal,
}

/// Loss, gradient and normal equations on the CPU.
#[derive(Debug)]
pub struct CpuEngine {
    setup: Setup,
    illumination: Illumination,
    views: Vec<ObservedView>,
    /// The views as the kernel reads them.
    records: Vec<Records>,
    loss: Loss,
    unknowns: Vec<Unknown>,
    plan: Plan,
    level: Level,
    /// Each pass reads every `stride`-th block of groups only.
    stride: usize,
    /// Sum of weights over the pixels that a pass reads, and how many of them count.
    weight: (f64, u64),
    /// The specular cube of the last exponent, and its slope.
    lobe: Mutex<Option<Arc<Lobe>>>,
    /// Kept terms, and the parameters that they were made with.
    kept: Mutex<Option<Arc<Kept>>>,
}

#[derive(Debug)]
struct Lobe {
    exponent: f64,
    cube: Cube<f32>,
    slope: Cube<f32>,
}

#[derive(Debug)]
struct Kept {
    key: [f64; 5],
    /// For each view, the plan's kept rows of each record.
    views: Vec<Vec<Row>>,
}

impl CpuEngine {
    /// An engine over `views` for the `unknowns`.
    #[must_use]
    pub fn new(
        setup: Setup,
        illumination: Illumination,
        views: Vec<ObservedView>,
        loss: Loss,
        unknowns: Vec<Unknown>,
    ) -> Self {
        Self::with_kept_terms(setup, illumination, views, loss, unknowns, true)
    }

    /// As [`Self::new`]; with `keep` false every lookup is done anew in each pass.
    #[must_use]
    pub fn with_kept_terms(
        setup: Setup,
        illumination: Illumination,
        views: Vec<ObservedView>,
        loss: Loss,
        unknowns: Vec<Unknown>,
        keep: bool,
    ) -> Self {
        let compare_alpha = views.iter().any(|view| !view.target[3].is_empty());
        let plan = Plan::new(setup, &unknowns, compare_alpha, keep);
        let mut engine = Self {
            setup,
            illumination,
            records: views.iter().map(Records::new).collect(),
            views,
            loss,
            unknowns,
            plan,
            level: Level::new(),
            stride: 1,
            weight: (0.0, 0),
            lobe: Mutex::new(None),
            kept: Mutex::new(None),
        };
        engine.set_stride(1);
        engine
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

    /// The blocks that a pass reads.
    fn read_blocks(&self, view: &ObservedView) -> impl Iterator<Item = usize> + use<> {
        (0..view.samples.groups().div_ceil(BLOCK)).step_by(self.stride)
    }

    /// The views.
    #[must_use]
    pub fn views(&self) -> &[ObservedView] {
        &self.views
    }

    /// Surface samples of positive weight, over all views.
    #[must_use]
    pub fn samples(&self) -> u64 {
        let samples = |view: &ObservedView| match view.samples.weight.as_slice() {
            [] => view.samples.records() * LANES,
            weights => weights.iter().filter(|&&w| w > 0.0).count(),
        };
        self.views.iter().map(|view| samples(view) as u64).sum()
    }

    /// The SIMD instructions that are used, by name.
    #[must_use]
    pub fn instructions(&self) -> String {
        instructions_of(self.level)
    }

    /// How many blocks of pixels there are in all views.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.views.iter().map(|view| view.samples.groups().div_ceil(BLOCK)).sum()
    }

    fn lobe(&self, exponent: f64) -> Option<Arc<Lobe>> {
        let stack = self.illumination.lobes.as_ref()?;
        let mut slot = self.lobe.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(lobe) = slot.as_ref().filter(|lobe| lobe.exponent == exponent) {
            return Some(Arc::clone(lobe));
        }
        let (cube, slope) = stack.at(exponent);
        let lobe = Arc::new(Lobe { exponent, cube, slope });
        *slot = Some(Arc::clone(&lobe));
        Some(lobe)
    }

    /// Terms that no free parameter changes, made on the first pass (and again should one of the
    /// held parameters differ).
    fn kept(&self, params: &Params, lobe: Option<&Lobe>) -> Arc<Kept> {
        let key = [
            Param::NormalStrength,
            Param::SpecularLobe,
            Param::EnvironmentRotation,
            Param::KeyAzimuth,
            Param::KeyElevation,
        ]
        .map(|p| {
            let free = self.unknowns.iter().any(|u| matches!(u, Unknown::Param(c) if c.param == p));
            if free { 0.0 } else { params.scalar(p) }
        });
        let mut slot = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = slot.as_ref().filter(|kept| kept.key == key) {
            return Arc::clone(kept);
        }
        let views = (0..self.views.len()).map(|index| self.make_kept(index, params, lobe)).collect();
        let kept = Arc::new(Kept { key, views });
        *slot = Some(Arc::clone(&kept));
        kept
    }

    fn make_kept(&self, index: usize, params: &Params, lobe: Option<&Lobe>) -> Vec<Row> {
        let stride = self.plan.kept.rows;
        let mut kept = vec![Row::ZERO; self.views[index].samples.records() * stride];
        if stride > 0 {
            let size = BLOCK * CHUNK;
            kept.par_chunks_mut(stride * size).enumerate().for_each(|(chunk, rows)| {
                dispatch!(self.level, simd => {
                    let kernel = self.kernel(simd, &self.records[index], &[], params, lobe, 1.0);
                    for (k, rows) in rows.chunks_exact_mut(stride).enumerate() {
                        kernel.keep(chunk * size + k, rows);
                    }
                });
            });
        }
        kept
    }

    #[inline(always)]
    fn kernel<'a, S: Simd>(
        &'a self,
        simd: S,
        view: &'a Records,
        kept: &'a [Row],
        params: &Params,
        lobe: Option<&'a Lobe>,
        gain: f64,
    ) -> Kernel<'a, S> {
        let like = Lanes::splat(simd, 0.0);
        let cubes = Cubes {
            irradiance: self.illumination.irradiance.as_ref(),
            specular: lobe.map(|l| &l.cube),
            lobe_slope: lobe.map(|l| &l.slope),
            hilite: self.illumination.hilite.as_ref(),
        };
        let turning = self.plan.lookups.contains(&LookupParam::EnvironmentRotation);
        Kernel {
            simd,
            plan: &self.plan,
            view,
            kept,
            lights: Lights::new(self.setup, params, cubes, turning, like),
            weights: Weights::new(params, self.setup.effects, like),
            strength: params.scalar(Param::NormalStrength) as f32,
            gain: gain as f32,
            loss: self.loss,
        }
    }

    /// The image of view `index` at `point`: for each pixel slot the mean over its visible samples,
    /// colour and (where the haze is compared) alpha, times the view's gain.
    #[must_use]
    pub fn image(&self, index: usize, point: &Point) -> Vec<Vec<f32>> {
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&point.params, lobe.as_deref());
        let view = &self.views[index];
        let groups = view.samples.groups();
        let channels = self.plan.channels.len();
        let mut planes = vec![vec![0.0_f32; groups * LANES]; channels];
        let size = BLOCK * CHUNK * LANES;
        let mut parts: Vec<Vec<&mut [f32]>> =
            planes.iter_mut().map(|plane| plane.chunks_mut(size).collect()).collect();
        let mut by_chunk: Vec<Vec<&mut [f32]>> = Vec::new();
        for _ in 0..groups.div_ceil(BLOCK * CHUNK) {
            by_chunk.push(parts.iter_mut().map(|part| part.remove(0)).collect());
        }
        let gain = point.gains.get(index).copied().unwrap_or(1.0);
        by_chunk.par_iter_mut().enumerate().for_each_init(
            || [Row::ZERO; WINDOW],
            |scratch, (chunk, outputs)| {
                dispatch!(self.level, simd => {
                    let kernel = self.kernel(simd, &self.records[index], &kept.views[index], &point.params, lobe.as_deref(), gain);
                    for (k, group) in (chunk * BLOCK * CHUNK..groups.min((chunk + 1) * BLOCK * CHUNK)).enumerate() {
                        kernel.group::<false>(group, scratch);
                        for (c, channel) in self.plan.channels.iter().enumerate() {
                            let row = &scratch[usize::from(channel.residual)];
                            for (out, value) in outputs[c][k * LANES..][..LANES].iter_mut().zip(row.iter()) {
                                *out = value * gain as f32;
                            }
                        }
                    }
                });
            },
        );
        planes
    }

    /// One pass: sums over every chunk of every view.
    fn pass(&self, point: &Point, wish: Wish) -> NormalEquations {
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&point.params, lobe.as_deref());
        let k = self.unknowns.len();
        let mut total = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: self.weight.0 * self.plan.channels.len() as f64,
            count: self.weight.1 * self.plan.channels.len() as u64,
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        for (index, view) in self.views.iter().enumerate() {
            let gain = point.gains.get(index).copied().unwrap_or(1.0);
            let groups = view.samples.groups();
            let blocks: Vec<usize> = self.read_blocks(view).collect();
            let sums: Vec<Sums> = blocks
                .par_chunks(CHUNK)
                .map_init(
                    || Scratch::new(&self.plan),
                    |scratch, blocks| {
                        dispatch!(self.level, simd => {
                            let kernel = self.kernel(simd, &self.records[index], &kept.views[index], &point.params, lobe.as_deref(), gain);
                            chunk(&kernel, blocks, groups, wish, scratch)
                        })
                    },
                )
                .collect();
            self.add(index, &pairwise(sums), wish, &mut total);
        }
        if total.weight > 0.0 {
            total.loss /= total.weight;
        }
        total
    }

    /// One view's packed sums into the full matrices.
    fn add(&self, view: usize, sums: &Sums, wish: Wish, total: &mut NormalEquations) {
        let Some(loss) = sums.0.last() else { return };
        total.loss += loss;
        let k = self.unknowns.len();
        let gain = self.unknowns.iter().position(|u| *u == Unknown::Gain(view));
        let mut base = 0;
        for channel in &self.plan.channels {
            let count = channel.columns + 1;
            let unknown: Vec<Option<usize>> = channel.unknowns.iter().map(|u| u.or(gain)).collect();
            match wish {
                Wish::Loss => {}
                Wish::Gradient => {
                    for i in 0..channel.columns {
                        if let Some(a) = unknown[i] {
                            total.jtr[a] += sums.0[base + i];
                        }
                    }
                    total.residual += sums.0[base + channel.columns];
                    base += count;
                }
                Wish::Normal => {
                    for i in 0..channel.columns {
                        let Some(a) = unknown[i] else { continue };
                        total.jtr[a] += sums.0[base + pair(i, channel.columns, count)];
                        for j in i..channel.columns {
                            let Some(b) = unknown[j] else { continue };
                            let value = sums.0[base + pair(i, j, count)];
                            total.jtj[a * k + b] += value;
                            if a != b {
                                total.jtj[b * k + a] += value;
                            }
                        }
                    }
                    total.residual += sums.0[base + pair(channel.columns, channel.columns, count)];
                    base += channel.pairs();
                }
            }
        }
    }
}

/// Packed sums of a chunk: each channel's triangle (or its last column), then the loss.
struct Sums(Vec<f64>);

/// Sum in a fixed binary tree: as accurate as it is deterministic.
fn pairwise(mut sums: Vec<Sums>) -> Sums {
    let mut width = sums.len();
    while width > 1 {
        let half = width.div_ceil(2);
        let (low, high) = sums.split_at_mut(half);
        for (a, b) in low.iter_mut().zip(&high[..width - half]) {
            for (x, y) in a.0.iter_mut().zip(&b.0) {
                *x += y;
            }
        }
        width = half;
    }
    sums.into_iter().next().unwrap_or(Sums(Vec::new()))
}

struct Scratch {
    rows: Vec<Row>,
    sums: Vec<Row>,
}

impl Scratch {
    fn new(plan: &Plan) -> Self {
        let pairs: usize = plan.channels.iter().map(ChannelPlan::pairs).sum();
        Self {
            rows: vec![Row::ZERO; plan.all_columns() * (BLOCK - 1) + WINDOW],
            sums: vec![Row::ZERO; pairs],
        }
    }
}

/// The sums over a few blocks.
#[inline(always)]
fn chunk<S: Simd>(
    kernel: &Kernel<'_, S>,
    blocks: &[usize],
    groups: usize,
    wish: Wish,
    scratch: &mut Scratch,
) -> Sums {
    let simd = kernel.simd;
    let Scratch { rows, sums } = scratch;
    let stride = kernel.plan.all_columns();
    sums.fill(Row::ZERO);
    let mut loss = Lanes::splat(simd, 0.0);
    let mut used = 0;
    for &block in blocks {
        let first = block * BLOCK;
        let length = groups.min(first + BLOCK) - first;
        for k in 0..length {
            let Some(rows) = rows[k * stride..].first_chunk_mut() else { break };
            if wish == Wish::Loss {
                kernel.group::<false>(first + k, rows);
                loss = loss + kernel.weigh::<false>(first + k, rows);
            } else {
                kernel.group::<true>(first + k, rows);
                loss = loss + kernel.weigh::<true>(first + k, rows);
            }
        }
        used = 0;
        for channel in &kernel.plan.channels {
            let count = channel.columns + 1;
            let columns = Columns { rows: &rows[..length * stride], stride, first: channel.start, count };
            match wish {
                Wish::Loss => {}
                Wish::Gradient => {
                    add_last(simd, columns, &mut sums[used..]);
                    used += count;
                }
                Wish::Normal => {
                    add_gram(simd, columns, &mut sums[used..]);
                    used += channel.pairs();
                }
            }
        }
    }
    let fold = |lanes: &[f32; LANES]| lanes.iter().map(|&x| f64::from(x)).sum::<f64>();
    let mut folded: Vec<f64> = sums[..used].iter().map(|row| fold(row)).collect();
    folded.push(fold(&loss.to_array()));
    Sums(folded)
}

impl Objective for CpuEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn is_quadratic(&self) -> bool {
        matches!(self.loss, Loss::L2 | Loss::RelativeL2) && self.views.iter().all(|view| view.clip.is_none())
    }

    fn rounding(&self) -> f64 {
        let read = |view: &ObservedView| {
            let groups = view.samples.groups();
            self.read_blocks(view).flat_map(|b| b * BLOCK..groups.min((b + 1) * BLOCK)).collect()
        };
        super::rounding(self.views.iter().map(|view| (view, read(view))), self.loss)
    }

    fn normal_equations(&self, point: &Point) -> NormalEquations {
        self.pass(point, Wish::Normal)
    }

    fn loss(&self, point: &Point) -> f64 {
        self.pass(point, Wish::Loss).loss
    }

    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        let sums = self.pass(point, Wish::Gradient);
        // The loss is a mean of rho, and J^T r sums d rho / 2.
        let factor = if sums.weight > 0.0 { 2.0 / sums.weight } else { 0.0 };
        (sums.loss, sums.jtr.iter().map(|x| factor * x).collect())
    }
}

/// The SIMD instructions that engines use on this processor, by name.
#[must_use]
pub fn instructions() -> String {
    instructions_of(Level::new())
}

fn instructions_of(level: Level) -> String {
    let name = format!("{level:?}");
    name.split('(').next().unwrap_or_default().to_owned()
}
