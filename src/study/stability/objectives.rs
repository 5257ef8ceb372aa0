//! Engines as evaluators: the sums over a batch's fragments, each a pixel with one sample.

use super::case::{Batch, EVERYTHING, FragmentInputs, Setting};
use super::evaluate::{Answer, Evaluator, Sums, TARGET};
use super::lights::LightBox;
use crate::engine::cpu::{CpuEngine, Illumination};
use crate::engine::view::ObservedView;
use crate::engine::{Objective, Point, Unknown};
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Param};
use crate::samples::{LANES, SurfaceArrays, ViewSamples};
use crate::scene::Loss;

/// What an engine is made of.
#[derive(Clone, Debug)]
pub struct EngineInputs {
    /// The switches of the model.
    pub setup: Setup,
    /// The cubes.
    pub illumination: Illumination,
    /// Samples and targets.
    pub views: Vec<ObservedView>,
    /// What is minimised.
    pub loss: Loss,
    /// What is free.
    pub unknowns: Vec<Unknown>,
}

/// Something that makes engines. An engine that has one is studied like every other.
pub trait EngineFactory: Sync {
    /// The engine's name in tables.
    fn name(&self) -> String;
    /// An engine over these views.
    ///
    /// # Errors
    /// When it cannot be made, in words.
    fn make(&self, inputs: EngineInputs) -> Result<Box<dyn Objective>, String>;
    /// The image of each slot of the first view, where the engine can show it.
    ///
    /// # Errors
    /// As [`Self::make`].
    fn image(&self, _inputs: EngineInputs, _point: &Point) -> Result<Option<Vec<Vec<f32>>>, String> {
        Ok(None)
    }
}

/// The CPU engine.
#[derive(Debug)]
pub struct Cpu;

impl Cpu {
    fn engine(inputs: EngineInputs) -> CpuEngine {
        let EngineInputs { setup, illumination, views, loss, unknowns } = inputs;
        CpuEngine::new(setup, illumination, views, loss, unknowns)
    }
}

impl EngineFactory for Cpu {
    fn name(&self) -> String {
        "CPU engine".to_owned()
    }
    fn make(&self, inputs: EngineInputs) -> Result<Box<dyn Objective>, String> {
        Ok(Box::new(Self::engine(inputs)))
    }
    fn image(&self, inputs: EngineInputs, point: &Point) -> Result<Option<Vec<Vec<f32>>>, String> {
        Ok(Some(Self::engine(inputs).image(0, point)))
    }
}

/// Every parameter, tied.
#[must_use]
pub fn unknowns() -> Vec<Unknown> {
    Param::all().map(|param| Unknown::Param(Column::tied(param))).collect()
}

/// An engine as an evaluator.
pub struct EngineEvaluator<F>(pub F);

impl<F: EngineFactory> Evaluator for EngineEvaluator<F> {
    fn name(&self) -> String {
        self.0.name()
    }

    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String> {
        let Setting { setup, params, lights: light, loss } = batch.setting;
        let inputs = EngineInputs {
            setup,
            illumination: lights.of(light).clone(),
            views: vec![view(setup, &batch.fragments, TARGET)],
            loss,
            unknowns: unknowns(),
        };
        let point = Point { params, gains: vec![1.0] };
        let count = batch.fragments.len();
        let values = self.0.image(inputs.clone(), &point)?.map(|planes| {
            let value = |slot: usize| [0, 1, 2, 3].map(|c: usize| f64::from(planes[c][slot]));
            (0..count).map(value).collect()
        });
        let engine = self.0.make(inputs)?;
        let equations = engine.normal_equations(&point);
        let (_, gradient) = engine.gradient(&point);
        let sums = Sums { equations, loss: engine.loss(&point), gradient };
        Ok(Answer { values, slopes: None, sums: Some(sums) })
    }

    fn engine(&self) -> Option<&dyn EngineFactory> {
        Some(&self.0)
    }
}

/// A view of one pixel a fragment, against one target; what fills the last group has no weight.
#[must_use]
pub fn view(setup: Setup, fragments: &[FragmentInputs], target: [f32; 4]) -> ObservedView {
    let groups = fragments.len().div_ceil(LANES);
    let mut samples = ViewSamples { group_start: (0..=groups as u32).collect(), ..ViewSamples::default() };
    let mut weight = Vec::new();
    for slot in 0..groups * LANES {
        // Padding repeats a fragment, as `samples` does.
        let real = slot < fragments.len();
        let inputs = &fragments[if real { slot } else { slot / LANES * LANES }];
        push(setup, inputs, &mut samples.surface);
        samples.pixel.push(if real { slot as u32 } else { u32::MAX });
        samples.coverage.push(f32::from(u8::from(real)));
        samples.weight.push(f32::from(u8::from(real)));
        weight.push(f32::from(u8::from(real)));
    }
    let target = target.map(|x| vec![x; groups * LANES]);
    ObservedView { samples, target, weight, clip: None }
}

fn push(setup: Setup, inputs: &FragmentInputs, into: &mut SurfaceArrays) {
    let f = inputs.fragment(setup, 0.0_f32);
    let vectors = [
        (f.base, &mut into.base),
        (f.bump, &mut into.bump),
        (f.view, &mut into.view),
        (f.normal, &mut into.normal),
        (f.albedo, &mut into.albedo),
    ];
    for (value, planes) in vectors {
        planes.iter_mut().zip(value).for_each(|(plane, x)| plane.push(x));
    }
    into.occlusion.push(f.occlusion);
    into.silhouette.push(f.silhouette);
    into.dapple.push(f.dapple);
    into.specular.push(f.specular);
    into.attenuator.push(f.attenuator);
}

/// What the checks of [`super::demands`] start from: ordinary fragments seen in every effect.
#[must_use]
pub fn ordinary_inputs(fragments: &[FragmentInputs], lights: &LightBox) -> (EngineInputs, Point) {
    let setting = Setting::ordinary();
    let setup = Setup { effects: EVERYTHING, ..setting.setup };
    let inputs = EngineInputs {
        setup,
        illumination: lights.of(setting.lights).clone(),
        views: vec![view(setup, fragments, TARGET)],
        loss: setting.loss,
        unknowns: unknowns(),
    };
    (inputs, Point { params: setting.params, gains: vec![1.0] })
}
