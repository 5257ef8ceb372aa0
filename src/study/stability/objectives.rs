//! Engines as evaluators: the sums over a batch's fragments, each a pixel with one sample.

use std::sync::Arc;

use super::case::{Batch, EVERYTHING, FragmentInputs, Setting};
use super::engine_factory::EngineFactory;
use super::evaluate::{Answer, Evaluator, Sums, TARGET};
use super::lights::LightBox;
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::engine::{Objective, Point, Task, Unknown};
use crate::gpu::Gpu;
use crate::gpu::engine::{GpuEngine, Memory};
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param};
use crate::samples::rows::{Row, Rows};
use crate::samples::surface_records::Asked;
use crate::samples::{LANES, SurfaceRecords, ViewSamples};

/// The CPU engine.
#[derive(Debug)]
pub struct Cpu;

impl Cpu {
    fn engine(task: &Task) -> Result<CpuEngine, String> {
        CpuEngine::new(task.clone()).map_err(|error| error.to_string())
    }
}

impl EngineFactory for Cpu {
    fn name(&self) -> String {
        "CPU engine".to_owned()
    }
    fn with(&self, task: &Task, _: &Point, then: &mut dyn FnMut(&dyn Objective)) -> Result<(), String> {
        then(&Self::engine(task)?);
        Ok(())
    }
    fn image(&self, task: &Task, point: &Point) -> Result<Vec<Vec<f32>>, String> {
        Ok(Self::engine(task)?.image(0, point))
    }
}

/// The GPU engine on an adapter.
pub struct OnAdapter(pub std::rc::Rc<super::shader::Adapter>);

impl OnAdapter {
    fn engine(gpu: &Gpu, task: &Task, point: &Point) -> Result<GpuEngine, String> {
        GpuEngine::new(gpu, task.clone(), point, Memory::default()).map_err(|error| error.to_string())
    }
}

impl EngineFactory for OnAdapter {
    fn name(&self) -> String {
        "GPU engine".to_owned()
    }
    /// As of the shader rules.
    fn slack(&self) -> f64 {
        4.0
    }
    fn with(&self, task: &Task, point: &Point, then: &mut dyn FnMut(&dyn Objective)) -> Result<(), String> {
        self.0.run(|gpu| {
            let engine = Self::engine(gpu, task, point)?;
            then(&engine);
            engine.device_fault().map_or(Ok(()), |error| Err(error.to_string()))
        })
    }
    fn image(&self, task: &Task, point: &Point) -> Result<Vec<Vec<f32>>, String> {
        self.0.run(|gpu| {
            let engine = Self::engine(gpu, task, point)?;
            engine.image(0, point).map_err(|error| error.to_string())
        })
    }
}

/// Every parameter, tied.
#[must_use]
pub fn unknowns() -> Vec<Unknown> {
    Param::built_in().map(|param| Unknown::Param(Column::tied(param))).collect()
}

/// An engine as an evaluator.
pub struct EngineEvaluator<F>(pub F);

impl<F: EngineFactory> Evaluator for EngineEvaluator<F> {
    fn name(&self) -> String {
        self.0.name()
    }

    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String> {
        let Setting { setup, params, lights: light, loss } = batch.setting.clone();
        let task = Task {
            setup,
            illumination: Arc::clone(lights.of(light)),
            views: Arc::new([view(setup, &batch.fragments, TARGET)]),
            loss,
            unknowns: unknowns(),
        };
        let point = Point { params, gains: vec![Gain::ONE] };
        let planes = self.0.image(&task, &point)?;
        let value = |slot: usize| [0, 1, 2, 3].map(|c: usize| f64::from(planes[c][slot]));
        let values = (0..batch.fragments.len()).map(value).collect();
        let mut sums = None;
        self.0.with(&task, &point, &mut |engine| {
            let equations = engine.normal_equations(&point);
            let (_, gradient) = engine.gradient(&point);
            sums = Some(Sums { equations, loss: engine.loss(&point), gradient });
        })?;
        Ok(Answer { values: Some(values), slopes: None, sums })
    }

    fn slack(&self) -> f64 {
        self.0.slack()
    }

    fn engine(&self) -> Option<&dyn EngineFactory> {
        Some(&self.0)
    }
}

/// A view of one pixel a fragment, against one target; what fills the last group has no weight.
#[must_use]
pub fn view(setup: Setup, fragments: &[FragmentInputs], target: [f32; 4]) -> ObservedView {
    let groups = fragments.len().div_ceil(LANES);
    let mut samples = ViewSamples {
        group_start: (0..=groups as u32).collect(),
        surface: SurfaceRecords::new(Asked::EVERYTHING, groups),
        ..ViewSamples::default()
    };
    for slot in 0..groups * LANES {
        // Padding repeats a fragment, as `samples` does.
        let real = slot < fragments.len();
        let inputs = &fragments[if real { slot } else { slot / LANES * LANES }];
        let share = f32::from(u8::from(real));
        samples.surface.set(slot, &inputs.fragment(setup, 0.0_f32), share);
        samples.pixel.push(if real { slot as u32 } else { u32::MAX });
        samples.coverage.push(share);
    }
    let weight = weights(&samples.coverage);
    ObservedView { samples, target: targets(&target, groups), weight, clip: None }
}

/// Each pixel counts as much as it is covered.
pub(super) fn weights(coverage: &[f32]) -> Vec<Row> {
    coverage.chunks(LANES).map(|group| Row::of(std::array::from_fn(|lane| group[lane]))).collect()
}

/// The same target for each pixel of `groups` groups: three or four channels.
#[must_use]
pub fn targets(target: &[f32], groups: usize) -> Rows {
    let mut rows = Rows::new(target.len(), groups);
    for (channel, &x) in target.iter().enumerate() {
        rows.plane_mut(channel).for_each(|pixel| *pixel = x);
    }
    rows
}

/// What the checks of [`super::demands`] start from: ordinary fragments seen in every effect.
#[must_use]
pub fn ordinary_task(fragments: &[FragmentInputs], lights: &LightBox) -> (Task, Point) {
    let setting = Setting::ordinary();
    let setup = Setup { effects: EVERYTHING, ..setting.setup };
    let task = Task {
        setup,
        illumination: Arc::clone(lights.of(setting.lights)),
        views: Arc::new([view(setup, fragments, TARGET)]),
        loss: setting.loss,
        unknowns: unknowns(),
    };
    (task, Point { params: setting.params, gains: vec![Gain::ONE] })
}
