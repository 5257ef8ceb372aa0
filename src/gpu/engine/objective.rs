//! What solvers see of the engine, and what else is asked of it.

use std::sync::Arc;

use super::GpuEngine;
use crate::GpuError;
use crate::scene::Loss;
use skinfit_core::engine::cpu::CpuEngine;
use skinfit_core::engine::pulls::Pulls;
use skinfit_core::engine::view::ObservedView;
use skinfit_core::engine::{
    Engine, EngineError, NormalEquations, Objective, PassOutputs, Point, Task, Unknown,
};

impl Objective for GpuEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.loss == Loss::L2 && !self.format.clipped
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
        self.pass(point, PassOutputs::Normal)
    }

    fn loss(&self, point: &Point) -> f64 {
        self.pass(point, PassOutputs::Loss).loss
    }

    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        self.pass(point, PassOutputs::Gradient).loss_and_gradient()
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
        self.weight.0 * f64::from(if self.alpha { 4_u32 } else { 3 })
    }

    fn own_sample_seconds(&self) -> Option<f64> {
        self.device_samples().map(|(_, seconds)| seconds)
    }

    fn set_stride(&mut self, stride: usize) {
        self.set_stride(stride);
    }
}
