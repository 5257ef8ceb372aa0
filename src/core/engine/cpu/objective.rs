//! What solvers see of the engine, and what else is asked of it.

use std::sync::Arc;

use super::CpuEngine;
use crate::engine::pulls::Pulls;
use crate::engine::view::ObservedView;
use crate::engine::{Engine, EngineError, NormalEquations, Objective, PassOutputs, Point, Unknown};
use crate::scene::Loss;

impl Objective for CpuEngine {
    fn unknowns(&self) -> &[Unknown] {
        &self.fitted.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.loss == Loss::L2 && self.views.iter().all(|view| view.clip.is_none())
    }

    fn rounding(&self) -> f64 {
        crate::engine::rounding(&self.views, self.loss, self.stride)
    }

    fn fault(&self) -> Option<String> {
        self.fault.get().cloned()
    }

    fn pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        if widths.len() == self.views.len() { self.tiled_pulls(point, widths) } else { None }
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
