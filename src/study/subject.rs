//! A scene in one setting, ready to be evaluated: baked, sampled, and with something to compare with.

use std::path::Path;

use super::StudyError;
use super::reference::Source;
use crate::engine::cpu::CpuEngine;
use crate::engine::{Point, Task};
use crate::fit::outcome::Outcome;
use crate::fit::{self, FitOptions};
use crate::model::effects::Effect;
use crate::model::params::{Column, Param, Params};
use crate::prepare::{Baked, Loaded, Observed, PrepareOptions, Sampled};
use crate::render::bloom::add_bloom;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::ViewSamples;
use crate::scene::Scene;
use crate::scene::view::{Target, View};

/// A scene in one setting.
#[derive(Debug)]
pub struct Subject {
    /// Its views that have something to be compared with.
    pub observed: Observed,
    /// The engine over them.
    pub engine: CpuEngine,
    /// What they are compared with.
    pub source: Source,
}

impl Subject {
    /// Prepare a scene. `change` is called once it is loaded: to hold parameters.
    ///
    /// Views are compared with `references`, where they are given, and else with their targets; without
    /// either, with what the model itself makes of them.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn new(
        scene: &Path,
        options: &PrepareOptions,
        references: Option<&[Image]>,
        change: impl FnOnce(&mut Loaded),
    ) -> Result<Self, StudyError> {
        let mut loaded = Loaded::read(scene, options)?;
        change(&mut loaded);
        Self::of(loaded.bake()?.sample()?, references)
    }

    /// As [`Self::new`], of a scene that is sampled.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn of(sampled: Sampled, references: Option<&[Image]>) -> Result<Self, StudyError> {
        let Sampled { baked, samples } = sampled;
        let own: Vec<Image>;
        let made = match references {
            Some(images) => Some(images),
            None if baked.scene.views.iter().all(|view| view.target.is_none()) => {
                own = images(&baked, &samples.iter().collect::<Vec<_>>(), &baked.start())?;
                Some(own.as_slice())
            }
            None => None,
        };
        let (baked, source) = match made {
            Some(images) => (compared_with(baked, images), Source::Model),
            None => (baked, Source::Targets),
        };
        let observed = baked.observe(samples)?;
        Ok(Self { engine: observed.engine()?, observed, source })
    }

    /// The image of each view at `point`, bloom and all: the model in f64.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn images(&self, point: &Point) -> Result<Vec<Image>, StudyError> {
        let samples: Vec<&ViewSamples> = self.engine.views().iter().map(|view| &view.samples).collect();
        images(&self.observed, &samples, point)
    }

    /// Fit what is free, from the scene's start.
    ///
    /// # Errors
    /// When the fit cannot be done; one that does not converge says so in its outcome.
    pub fn fit(&self, options: &FitOptions) -> Result<Outcome, StudyError> {
        self.fit_from(&self.observed.start(), options)
    }

    /// Fit what is free, from `start`.
    ///
    /// # Errors
    /// When the fit cannot be done; one that does not converge says so in its outcome.
    pub fn fit_from(&self, start: &Point, options: &FitOptions) -> Result<Outcome, StudyError> {
        fit::fit(&self.engine, start, options, &mut |_| {})
            .map_err(|error| StudyError::Fit { scene: self.observed.scene.path.display().to_string(), error })
    }

    /// An engine over the same samples that keeps nothing from pass to pass: every lookup is done anew, as in
    /// a renderer. For timing.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn live_engine(&self) -> Result<CpuEngine, StudyError> {
        let task = Task { unknowns: Vec::new(), ..self.observed.task() };
        Ok(CpuEngine::with_kept_terms(task, false)?)
    }
}

/// The scene with these images as its views' targets.
fn compared_with(baked: Baked, images: &[Image]) -> Baked {
    baked.with_scene(|scene| {
        for (view, image) in scene.views.iter_mut().zip(images) {
            let (rgb, alpha) = (image.rgb.clone(), Some(image.alpha.clone()));
            view.target = Some(Target { rgb, alpha, haze: None, mask: None, clipped_at: None });
        }
    })
}

fn images(baked: &Baked, samples: &[&ViewSamples], point: &Point) -> Result<Vec<Image>, StudyError> {
    let shader = Shader::new(baked.setup(), &baked.illumination, &point.params)?;
    Ok(shaded(&baked.scene, &shader, samples, &point.gains))
}

/// The image of each view of `scene`, bloom and all, times its gain.
#[must_use]
pub fn shaded(scene: &Scene, shader: &Shader, samples: &[&ViewSamples], gains: &[f64]) -> Vec<Image> {
    let views = scene.views.iter().zip(samples).enumerate();
    let image = |(i, (view, samples)): (usize, (&View, &&ViewSamples))| {
        let mut shaded = shader.shade(samples, &view.camera, gains.get(i).copied().unwrap_or(1.0));
        if scene.effects.has(Effect::Bloom) {
            add_bloom(&mut shaded.image, &shaded.glow, scene.bloom.sigma);
        }
        shaded.image
    };
    views.map(image).collect()
}

/// Hold `param` at `value`: it is no longer free.
pub fn hold(params: &mut Params, free: &mut Vec<Column>, param: Param, value: f64) {
    params.set(param, value);
    free.retain(|column| column.param != param);
}
