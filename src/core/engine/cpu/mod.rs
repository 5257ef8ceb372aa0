//! The CPU engine: all cores, SIMD, and the same sums for any number of threads.
//!
//! Samples are cut into chunks of a fixed number of groups. Within a chunk products are summed in
//! f32 lanes (at most 64 terms a lane), then folded to f64; the chunks' sums are added pairwise in
//! their order. So the order of additions never depends on threads, and the rounding error stays
//! that of short sums however many samples there are.
//!
//! - `kept`: what stays from pass to pass: the lobe's cube, and terms that no free parameter moves
//! - `sums`: the sums of a chunk, and the fixed tree that adds chunks
//! - `image`: the forward pass
//! - `pulls`: a pass that keeps the tiles of the images apart

pub(super) mod image;
mod kept;
pub(super) mod lobe;
mod pulls;
pub(super) mod sums;

use std::sync::{Arc, Mutex};

use fearless_simd::Level;
use rayon::prelude::*;

use self::kept::Kept;
use self::lobe::Lobe;
use self::sums::{BLOCK, Blocks, CHUNK, Scratch, Sums, Wish, pairwise};
use super::gram::pair;
use super::kernel::Kernel;
use super::lanes::Lanes;
use super::plan::Plan;
use super::planned::PlannedEngine;
use super::pulls::Pulls;
use super::records::Records;
use super::view::ObservedView;
use super::{NormalEquations, Objective, Point, Unknown};
use crate::bake::Illumination;
use crate::model::compose::Weights;
use crate::model::evaluate::Setup;
use crate::model::lights::{Cubes, Lights};
use crate::model::params::{Param, Params};
use crate::model::terms::LookupParam;
use crate::samples::rows::Row;
use crate::scene::Loss;
use crate::simd::Simd;
use crate::with_simd;

/// Loss, gradient and normal equations on the CPU.
#[derive(Debug)]
pub struct CpuEngine {
    setup: Setup,
    illumination: Illumination,
    views: Vec<ObservedView>,
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
    /// What runs in the place of the kernel where the rules say what the kernel does not know; or why the processor
    /// cannot compute them.
    planned: Option<Result<PlannedEngine, String>>,
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
        mut views: Vec<ObservedView>,
        loss: Loss,
        unknowns: Vec<Unknown>,
        keep: bool,
    ) -> Self {
        let compare_alpha = views.iter().any(ObservedView::compares_alpha);
        let plan = Plan::new(setup, &unknowns, compare_alpha, keep);
        let planned = (!setup.hand_written()).then(|| {
            let views = std::mem::take(&mut views);
            let engine = PlannedEngine::new(setup, illumination.clone(), views, loss, unknowns.clone());
            let mut engine = engine.map_err(|error| error.to_string())?;
            engine.set_keep(keep);
            Ok(engine)
        });
        let mut engine = Self {
            setup,
            illumination,
            views,
            loss,
            unknowns,
            plan,
            level: Level::new(),
            stride: 1,
            weight: (0.0, 0),
            lobe: Mutex::new(None),
            kept: Mutex::new(None),
            planned,
        };
        engine.set_stride(1);
        engine
    }

    /// Let each pass read only every `stride`-th block of pixels: a coarse fit on a fraction of them.
    pub fn set_stride(&mut self, stride: usize) {
        self.stride = stride.max(1);
        if let Some(Ok(planned)) = &mut self.planned {
            planned.set_stride(stride);
        }
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
        if let Some(Ok(planned)) = &mut self.planned {
            planned.set_level(level);
        }
        // What was kept was made with other instructions.
        (self.lobe, self.kept) = (Mutex::new(None), Mutex::new(None));
    }

    /// The blocks that a pass reads.
    fn read_blocks(&self, view: &ObservedView) -> impl Iterator<Item = usize> + use<> {
        (0..view.samples.groups().div_ceil(BLOCK)).step_by(self.stride)
    }

    /// The views.
    #[must_use]
    pub fn views(&self) -> &[ObservedView] {
        match &self.planned {
            Some(Ok(planned)) => planned.views(),
            _ => &self.views,
        }
    }

    /// Surface samples of positive weight, over all views.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.views().iter().map(|view| view.samples.count() as u64).sum()
    }

    /// How many blocks of pixels there are in all views.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.views().iter().map(|view| view.samples.groups().div_ceil(BLOCK)).sum()
    }

    #[inline(always)]
    fn kernel<'a, S: Simd>(
        &'a self,
        simd: S,
        view: &'a ObservedView,
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
            view: Records::new(view),
            kept,
            lights: Lights::new(self.setup, params, cubes, turning, like),
            weights: Weights::new(params, self.setup.effects, like),
            strength: params.scalar(Param::NormalStrength) as f32,
            gain: gain as f32,
            loss: self.loss,
        }
    }

    /// One pass: sums over every chunk of every view.
    fn pass(&self, point: &Point, wish: Wish) -> NormalEquations {
        match &self.planned {
            None => self.sum(point, wish),
            Some(Ok(planned)) => planned.pass(point, wish),
            // Told by `fault`; nothing takes the number for the loss.
            Some(Err(_)) => NormalEquations { loss: f64::NAN, ..self.sum(point, wish) },
        }
    }

    fn sum(&self, point: &Point, wish: Wish) -> NormalEquations {
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
                        with_simd!(self.level, simd => {
                            let kernel = self.kernel(simd, view, &kept.views[index], &point.params, lobe.as_deref(), gain);
                            sums::chunk(&kernel, Blocks { blocks, groups }, wish, scratch)
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

impl Objective for CpuEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.loss == Loss::L2 && self.views().iter().all(|view| view.clip.is_none())
    }

    fn rounding(&self) -> f64 {
        super::rounding(self.views(), self.loss, self.stride)
    }

    fn fault(&self) -> Option<String> {
        self.planned.as_ref().and_then(|planned| planned.as_ref().err()).cloned()
    }

    fn pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        match &self.planned {
            _ if widths.len() != self.views().len() => None,
            None => Some(self.kernel_pulls(point, widths)),
            Some(planned) => planned.as_ref().ok()?.pulls(point, widths),
        }
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
