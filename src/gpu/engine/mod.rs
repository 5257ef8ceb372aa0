//! The GPU engine: the fused pass ([`fused`]) over samples on a graphics adapter.
//!
//! - [`GpuEngine`]: the objective; what it is made of and how sums become normal equations
//! - [`fused`]: the text of that pass
//! - `parts`: samples and targets on the device, in parts that fit a binding; what does not fit the
//!   memory allowed is uploaded anew in each pass
//! - [`DeviceSamples`]: samples that the adapter makes itself, by the production renderer's geometry pass
//! - `terms`: samples replaced by their terms, where no free parameter needs a lookup
//! - `levels`: what samples look up of the UV atlas
//! - `lights`: the cubes and the uniform block, as shaders are given them
//! - `program`: the shaders of a wish, and one run of them
//! - `images`: the forward pass: images, and how long they take
//! - `pipeline`: what both make pipelines and bindings with

pub mod fused;
mod images;
mod levels;
mod lights;
mod parts;
mod pipeline;
mod program;
mod samples;
mod terms;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use web_time::Instant;

use self::fused::{ColumnOf, Fitted, Fused, Layout, Sum, Wish, held_parameters};
use self::images::Images;
use self::levels::DeviceLevels;
use self::lights::DeviceLights;
use self::parts::{Parts, Traits};
use self::program::Program;
pub use self::samples::{DeviceSampleError, DeviceSamples};
use self::terms::replace_samples;
use crate::bake::Illumination;
use crate::model::evaluate::Setup;
use crate::model::params::Param;
use crate::model::terms::TermName;
use crate::scene::Loss;
use crate::shader::facts::FaceSizes;
use crate::{Gpu, GpuError};
use skinfit_core::engine::cpu::CpuEngine;
use skinfit_core::engine::pulls::Pulls;
use skinfit_core::engine::view::ObservedView;
use skinfit_core::engine::{BLOCK, Engine, EngineError, NormalEquations, Objective, Point, Task, Unknown};

/// How much of the device is used.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    /// Most bytes of a part: the adapter's limit for a binding, unless this is lower.
    pub part: Option<u64>,
    /// Most bytes that stay on the device; parts beyond it are uploaded in each pass. Without: all stay.
    pub resident: Option<u64>,
}

/// Loss, gradient and normal equations on a graphics adapter.
pub struct GpuEngine {
    gpu: Gpu,
    /// What makes the samples, where they are not uploaded.
    made: Option<Arc<DeviceSamples>>,
    /// What making them took.
    made_seconds: f64,
    setup: Setup,
    views: Arc<[ObservedView]>,
    /// For the one pass that the CPU makes: see `pulls`.
    illumination: Arc<Illumination>,
    loss: Loss,
    unknowns: Vec<Unknown>,
    stride: usize,
    /// Sum of weights over the pixels that a pass reads, and how many of them count.
    weight: (f64, u64),
    alpha: bool,
    traits: Traits,
    /// What samples look up of the UV atlas, each with how many numbers it has: where the environment is not turned, and
    /// where it is.
    looked_up: [Vec<(String, usize)>; 2],
    /// The parameters that terms are made with, where terms stand in the place of samples.
    held: Option<Vec<Param>>,
    /// What changes between passes; a pass at a time.
    device: Mutex<OnDevice>,
    fault: Mutex<Option<GpuError>>,
}

/// What is on the device.
struct OnDevice {
    parts: Parts,
    lights: DeviceLights,
    /// Where something is computed in texels.
    levels: Option<DeviceLevels>,
    /// By wish, and by what is written into the text.
    programs: BTreeMap<(Wish, Written), Program>,
    /// What the terms were made with that stand in the samples' place.
    terms: Option<Vec<[f64; 3]>>,
    /// Whether terms stand there, perhaps in some parts only.
    replaced: bool,
    /// The forward pass, and what is written into its text: with a term, that one alone.
    images: Option<((Written, Option<TermName>), Images)>,
}

/// What of a point is written into shaders' text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Written {
    /// Whether the environment is turned, or will be.
    turned: bool,
    /// Whether a view's gain is not 1, or will not be.
    gained: bool,
}

impl GpuEngine {
    /// An engine for a task; the shaders for passes at `start` are compiled.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn new(gpu: &Gpu, task: Task, start: &Point, memory: Memory) -> Result<Self, GpuError> {
        Self::build(gpu, None, task, start, memory)
    }

    /// As [`Self::new`], over samples that the adapter makes: the task's views hold the groups that came with them,
    /// in their order, and no surface. All of them stay on the device.
    ///
    /// # Errors
    /// When the device does not take it, or may not keep as much.
    pub fn over_device_samples(
        samples: Arc<DeviceSamples>,
        task: Task,
        start: &Point,
        memory: Memory,
    ) -> Result<Self, GpuError> {
        let gpu = samples.gpu().clone();
        Self::build(&gpu, Some(samples), task, start, memory)
    }

    fn build(
        gpu: &Gpu,
        made: Option<Arc<DeviceSamples>>,
        task: Task,
        start: &Point,
        memory: Memory,
    ) -> Result<Self, GpuError> {
        let Task { setup, illumination, views, loss, unknowns } = task;
        // Mesa's software driver loses its device over a pass that looks nothing up and weighs nothing.
        if TermName::of(setup.effects).is_empty() && !setup.needs().haze {
            return Err(GpuError::NothingShown);
        }
        let alpha = views.iter().any(ObservedView::compares_alpha);
        let traits = Traits::of(gpu, &views)?;
        let mut engine = Self {
            gpu: gpu.clone(),
            made,
            made_seconds: 0.0,
            setup,
            illumination: Arc::clone(&illumination),
            loss,
            unknowns,
            stride: 1,
            weight: (0.0, 0),
            alpha,
            traits,
            looked_up: [Vec::new(), Vec::new()],
            held: None,
            device: Mutex::new(OnDevice {
                parts: Parts::default(),
                lights: DeviceLights::new(illumination),
                levels: None,
                programs: BTreeMap::new(),
                terms: None,
                replaced: false,
                images: None,
            }),
            fault: Mutex::new(None),
            views,
        };
        engine.upload(memory)?;
        let samples = Layout::of_samples(&engine.traits.places, engine.traits.rows);
        let terms = Layout::of_terms(setup, &samples);
        let device = engine.device.get_mut().unwrap_or_else(PoisonError::into_inner);
        // What is looked up of the UV atlas stands beside samples, and not beside their terms.
        if !device.parts.have_levels() && device.parts.all_hold(terms.rows, &engine.views) {
            let faces = device.lights.face_sizes();
            let held =
                held_parameters(&engine.fitted(engine.written(start), faces)).map_err(GpuError::Plan)?;
            let moves = |u: &Unknown| matches!(u, Unknown::Param(c) if held.contains(&c.param));
            engine.held = (!engine.unknowns.iter().any(moves)).then_some(held);
        }
        engine.set_stride(1);
        // Whatever the driver refuses shows here, and not in the midst of a fit.
        engine.sums(start, Wish::Normal)?;
        Ok(engine)
    }

    /// Have samples, targets, and room for what is looked up, on the device.
    fn upload(&mut self, memory: Memory) -> Result<(), GpuError> {
        let faces = self.lock().lights.face_sizes();
        let fitted = |turned| self.fitted(Written { turned, gained: false }, faces);
        let levels = DeviceLevels::new(fitted, &self.views)?;
        if let Some(levels) = &levels {
            self.traits.levels = levels.rows();
            self.looked_up = [false, true].map(|turned| levels.fields(turned));
        }
        let start = Instant::now();
        let parts = Parts::new(&self.gpu, &self.views, &self.traits, memory, self.made.as_deref())?;
        let own = |made: &Arc<DeviceSamples>| made.seconds() + start.elapsed().as_secs_f64();
        self.made_seconds = self.made.as_ref().map_or(0.0, own);
        let device = self.device.get_mut().unwrap_or_else(PoisonError::into_inner);
        (device.parts, device.levels) = (parts, levels);
        Ok(())
    }

    /// Let each pass read only every `stride`-th block of pixels: a coarse fit on a fraction of them.
    pub fn set_stride(&mut self, stride: usize) {
        self.stride = stride.max(1);
        let device = self.device.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.weight = device.parts.set_stride(self.stride);
    }

    /// The views.
    #[must_use]
    pub const fn views(&self) -> &Arc<[ObservedView]> {
        &self.views
    }

    /// Bytes of the buffers that hold samples, targets and weights on the device, and bytes that each pass for the
    /// normal equations uploads: once for each of its shaders.
    #[must_use]
    pub fn bytes(&self) -> (u64, u64) {
        let device = self.lock();
        let (held, streamed) = device.parts.bytes();
        let normal = device.programs.iter().find(|((wish, _), _)| *wish == Wish::Normal);
        (held, streamed * normal.map_or(1, |(_, program)| program.shaders()))
    }

    /// What made the samples where they were not uploaded, and the seconds that it took.
    #[must_use]
    pub fn device_samples(&self) -> Option<(&DeviceSamples, f64)> {
        Some((self.made.as_deref()?, self.made_seconds))
    }

    /// The adapter's name.
    #[must_use]
    pub fn adapter(&self) -> &str {
        self.gpu.name()
    }

    /// How many blocks of pixels there are in all views.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.views.iter().map(|view| view.samples.groups().div_ceil(BLOCK)).sum()
    }

    /// Why no pass can be made any more, if so.
    #[must_use]
    pub fn device_fault(&self) -> Option<GpuError> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn lock(&self) -> MutexGuard<'_, OnDevice> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn written(&self, point: &Point) -> Written {
        let turns = |u: &Unknown| matches!(u, Unknown::Param(c) if c.param == Param::EnvironmentRotation);
        let gains = |u: &Unknown| matches!(u, Unknown::Gain(_));
        Written {
            turned: point.params.scalar(Param::EnvironmentRotation) != 0.0 || self.unknowns.iter().any(turns),
            gained: point.gains.iter().any(|gain| *gain != 1.0) || self.unknowns.iter().any(gains),
        }
    }

    /// What is the same for every view, over samples.
    fn fitted(&self, written: Written, faces: FaceSizes) -> Fitted {
        Fitted {
            setup: self.setup,
            output: None,
            unknowns: self.unknowns.clone(),
            loss: self.loss,
            alpha: self.alpha,
            turned: written.turned,
            gained: written.gained,
            faces,
            layout: Layout::of_samples(&self.traits.places, self.traits.rows)
                .with_levels(self.looked_up[usize::from(written.turned)].clone(), self.traits.levels),
            several: self.traits.several,
            weighted: self.traits.weighted,
            clipped: self.traits.clipped,
        }
    }

    fn fused(&self, written: Written, faces: FaceSizes, output: Option<TermName>) -> Result<Fused, GpuError> {
        let mut fitted = Fitted { output, ..self.fitted(written, faces) };
        if self.held.is_some() {
            fitted.layout = Layout::of_terms(self.setup, &fitted.layout);
        }
        Fused::new(fitted).map_err(GpuError::Plan)
    }

    /// Have on the device what samples look up of the UV atlas at `point`.
    fn look_up(&self, point: &Point, device: &mut OnDevice) -> Result<(), GpuError> {
        let OnDevice { parts, levels, .. } = device;
        let Some(levels) = levels else { return Ok(()) };
        let at = (self.written(point).turned, &point.params);
        levels.set(&self.gpu, at, &self.illumination, &self.views, parts)
    }

    /// How often levels of the UV atlas were made: once for as long as nothing changes that moves them.
    #[must_use]
    pub fn levels_made(&self) -> u64 {
        self.lock().levels.as_ref().map_or(0, DeviceLevels::count)
    }

    /// Have the terms at `point` in the place of the samples, where that is how passes are made.
    fn keep(&self, point: &Point, device: &mut OnDevice) -> Result<(), GpuError> {
        let Some(held) = &self.held else { return Ok(()) };
        let key: Vec<[f64; 3]> = held.iter().map(|&param| point.params.rgb(param)).collect();
        if device.terms.as_ref() == Some(&key) {
            return Ok(());
        }
        let OnDevice { parts, lights, programs, images, terms, replaced, .. } = device;
        *terms = None;
        if std::mem::replace(replaced, true) {
            parts.reload(&self.gpu, &self.views, self.made.as_deref())?;
        }
        // Their bindings are to the buffers before.
        programs.clear();
        *images = None;
        let fitted = self.fitted(self.written(point), lights.face_sizes());
        let layout = Layout::of_terms(self.setup, &fitted.layout);
        replace_samples(&self.gpu, &fitted, &layout, &point.params, lights, parts, &self.views)?;
        *terms = Some(key);
        Ok(())
    }

    /// One pass: for each part of each view its sums.
    fn sums(&self, point: &Point, wish: Wish) -> Result<Passed, GpuError> {
        let written = self.written(point);
        let mut device = self.lock();
        self.keep(point, &mut device)?;
        self.look_up(point, &mut device)?;
        let OnDevice { parts, lights, programs, .. } = &mut *device;
        let program = match programs.entry((wish, written)) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => {
                let fused = self.fused(written, lights.face_sizes(), None)?;
                entry.insert(Program::new(&self.gpu, fused, wish, parts)?)
            }
        };
        lights.set(&self.gpu, &point.params, &mut program.inputs)?;
        let sums = program.run(&self.gpu, parts, &self.views, &point.gains)?;
        Ok(Passed { sums, columns: program.columns().to_vec(), view_of: parts.views() })
    }

    /// How many numbers of a pixel are compared.
    const fn channels(&self) -> u32 {
        if self.alpha { 4 } else { 3 }
    }

    /// A pass as normal equations; after a fault, numbers that no solver takes.
    fn pass(&self, point: &Point, wish: Wish) -> NormalEquations {
        let channels = self.channels();
        let k = self.unknowns.len();
        let mut total = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: self.weight(),
            count: self.weight.1 * u64::from(channels),
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        match self.sums(point, wish) {
            Ok(passed) => passed.add_to(&mut total, &self.unknowns),
            Err(error) => {
                self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                total.loss = f64::NAN;
            }
        }
        if total.weight > 0.0 {
            total.loss /= total.weight;
        }
        total
    }
}

/// What a pass yielded.
struct Passed {
    /// For each part, its sums.
    sums: Vec<Vec<(Sum, f64)>>,
    columns: Vec<ColumnOf>,
    /// For each part, its view.
    view_of: Vec<usize>,
}

impl Passed {
    /// Add the parts' sums, in their order.
    fn add_to(&self, total: &mut NormalEquations, unknowns: &[Unknown]) {
        let k = unknowns.len();
        for (sums, &view) in self.sums.iter().zip(&self.view_of) {
            let gain = unknowns.iter().position(|u| *u == Unknown::Gain(view));
            let unknown = |i: usize| self.columns[i].unknown.or(gain);
            let last = self.columns.len();
            for &(sum, value) in sums {
                match sum {
                    Sum::Loss => total.loss += value,
                    Sum::Product(i, j) if i == last && j == last => total.residual += value,
                    Sum::Product(i, j) if j == last => {
                        if let Some(a) = unknown(i) {
                            total.jtr[a] += value;
                        }
                    }
                    Sum::Product(i, j) => {
                        let (Some(a), Some(b)) = (unknown(i), unknown(j)) else { continue };
                        total.jtj[a * k + b] += value;
                        if a != b {
                            total.jtj[b * k + a] += value;
                        }
                    }
                }
            }
        }
    }
}

impl Objective for GpuEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.loss == Loss::L2 && !self.traits.clipped
    }

    fn rounding(&self) -> f64 {
        skinfit_core::engine::rounding(&self.views, self.loss, self.stride)
    }

    /// Made by the CPU engine, from the samples that this one uploaded; of samples that the adapter made there are
    /// none.
    fn pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        if self.made.is_some() {
            return None;
        }
        let task = Task {
            setup: self.setup,
            illumination: Arc::clone(&self.illumination),
            views: Arc::clone(&self.views),
            loss: self.loss,
            unknowns: self.unknowns.clone(),
        };
        // What is kept for later passes would be memory for nothing: this is the only one.
        let mut engine = CpuEngine::with_kept_terms(task, false).ok()?;
        engine.set_stride(self.stride);
        engine.pulls(point, widths)
    }

    fn fault(&self) -> Option<String> {
        self.device_fault().map(|error| error.to_string())
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

impl Engine for GpuEngine {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn provenance(&self) -> Vec<(String, String)> {
        let (resident, streamed) = self.bytes();
        let samples =
            if self.made.is_some() { "made by the adapter" } else { "made by the CPU and uploaded" };
        vec![
            ("adapter".to_owned(), self.adapter().to_owned()),
            ("samples".to_owned(), samples.to_owned()),
            ("bytes on the device".to_owned(), resident.to_string()),
            ("bytes uploaded a pass".to_owned(), streamed.to_string()),
        ]
    }

    fn views(&self) -> &Arc<[ObservedView]> {
        self.views()
    }

    fn surfaced_views(&self) -> Result<Arc<[ObservedView]>, EngineError> {
        let Some(made) = &self.made else { return Ok(Arc::clone(&self.views)) };
        let surfaced = self.views.iter().enumerate().map(|(index, view)| {
            let mut view = view.clone();
            view.samples.surface = made.read(index, &view.samples)?;
            Ok(view)
        });
        Ok(surfaced.collect::<Result<_, GpuError>>()?)
    }

    fn samples(&self) -> u64 {
        match &self.made {
            Some(made) => made.count() as u64,
            None => self.views.iter().map(|view| view.samples.count() as u64).sum(),
        }
    }

    fn weight(&self) -> f64 {
        self.weight.0 * f64::from(self.channels())
    }

    fn own_sample_seconds(&self) -> Option<f64> {
        self.device_samples().map(|(_, seconds)| seconds)
    }

    fn set_stride(&mut self, stride: usize) {
        self.set_stride(stride);
    }
}
