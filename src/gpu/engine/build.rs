//! How an engine is made: samples and targets on the device, and the first pass' shaders.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use web_time::Instant;

use super::fused::{Layout, held_parameters};
use super::levels::DeviceLevels;
use super::lights::DeviceLights;
use super::parts::{Parts, ViewFormat};
use super::{DeviceSamples, GpuEngine, Memory, OnDevice, Specialization};
use crate::model::terms::TermName;
use crate::{Gpu, GpuError};
use skinfit_core::engine::view::ObservedView;
use skinfit_core::engine::{PassOutputs, Point, Task, Unknown};

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
        let format = ViewFormat::of(gpu, &views)?;
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
            format,
            looked_up: Default::default(),
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
        let samples = Layout::of_samples(&engine.format.places, engine.format.rows);
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
        engine.sums(start, PassOutputs::Normal)?;
        Ok(engine)
    }

    /// Have samples, targets, and room for what is looked up, on the device.
    fn upload(&mut self, memory: Memory) -> Result<(), GpuError> {
        let faces = self.lock().lights.face_sizes();
        let fitted = |turned| self.fitted(Specialization { turned, gained: false }, faces);
        let levels = DeviceLevels::new(&self.gpu, fitted, &self.views)?;
        if let Some(levels) = &levels {
            self.format.levels = levels.rows();
            self.looked_up = [false, true].map(|turned| levels.looked(turned));
        }
        let shared = levels.as_ref().and_then(DeviceLevels::buffer);
        let start = Instant::now();
        let parts = Parts::new(&self.gpu, &self.views, &self.format, memory, (self.made.as_deref(), shared))?;
        let own = |made: &Arc<DeviceSamples>| made.seconds() + start.elapsed().as_secs_f64();
        self.made_seconds = self.made.as_ref().map_or(0.0, own);
        let device = self.device.get_mut().unwrap_or_else(PoisonError::into_inner);
        (device.parts, device.levels) = (parts, levels);
        Ok(())
    }
}
