//! A scene in one setting, ready to be evaluated: baked, sampled, and with something to compare with.

use std::path::Path;
use std::sync::Arc;

use super::StudyError;
use super::reference::Source;
use crate::engine::cpu::CpuEngine;
use crate::engine::{Point, Task};
use crate::fit::outcome::Outcome;
use crate::fit::{self, FitOptions};
use crate::model::effects::Effect;
use crate::model::params::{Column, Param, Params};
use crate::prepare::{PrepareOptions, Prepared};
use crate::render::bloom::add_bloom;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::ViewSamples;
use crate::scene::Scene;
use crate::scene::view::{Target, View};

/// A scene in one setting.
#[derive(Debug)]
pub struct Subject {
    /// Its stages; the samples are in the engine.
    pub prepared: Prepared,
    /// The engine over the views that have something to be compared with.
    pub engine: CpuEngine,
    /// What that is.
    pub source: Source,
}

impl Subject {
    /// Prepare a scene. `change` is called once it is loaded and sampled: to hold parameters.
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
        change: &dyn Fn(&mut Prepared),
    ) -> Result<Self, StudyError> {
        let mut prepared = Prepared::new(scene, options)?;
        change(&mut prepared);
        Self::of(prepared, references)
    }

    /// As [`Self::new`], of a scene that is prepared.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn of(mut prepared: Prepared, references: Option<&[Image]>) -> Result<Self, StudyError> {
        let own: Vec<Image>;
        let made = match references {
            Some(images) => Some(images),
            None if prepared.scene.views.iter().all(|view| view.target.is_none()) => {
                own = images(&prepared, &prepared.samples.iter().collect::<Vec<_>>(), &prepared.start())?;
                Some(own.as_slice())
            }
            None => None,
        };
        let views = Arc::make_mut(&mut prepared.scene).views.iter_mut();
        for (view, image) in views.zip(made.into_iter().flatten()) {
            let (rgb, alpha) = (image.rgb.clone(), Some(image.alpha.clone()));
            view.target = Some(Target { rgb, alpha, haze: None, mask: None, clipped_at: None });
        }
        let source = if made.is_some() { Source::Model } else { Source::Targets };
        let engine = prepared.engine()?;
        Ok(Self { prepared, engine, source })
    }

    /// The image of each view at `point`, bloom and all: the model in f64.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn images(&self, point: &Point) -> Result<Vec<Image>, StudyError> {
        let samples: Vec<&ViewSamples> = self.engine.views().iter().map(|view| &view.samples).collect();
        images(&self.prepared, &samples, point)
    }

    /// Fit what is free, from the scene's start.
    ///
    /// # Errors
    /// When the fit cannot be done; one that does not converge says so in its outcome.
    pub fn fit(&self, options: &FitOptions) -> Result<Outcome, StudyError> {
        self.fit_from(&self.prepared.start(), options)
    }

    /// Fit what is free, from `start`.
    ///
    /// # Errors
    /// When the fit cannot be done; one that does not converge says so in its outcome.
    pub fn fit_from(&self, start: &Point, options: &FitOptions) -> Result<Outcome, StudyError> {
        fit::fit(&self.engine, start, options, &mut |_| {})
            .map_err(|error| StudyError::Fit { scene: self.prepared.scene.path.display().to_string(), error })
    }

    /// An engine over the same samples that keeps nothing from pass to pass: every lookup is done anew, as in
    /// a renderer. For timing.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn live_engine(&self) -> Result<CpuEngine, StudyError> {
        let views = Arc::clone(self.engine.views());
        let task = Task { unknowns: Vec::new(), ..self.prepared.task(views) };
        Ok(CpuEngine::with_kept_terms(task, false)?)
    }
}

fn images(prepared: &Prepared, samples: &[&ViewSamples], point: &Point) -> Result<Vec<Image>, StudyError> {
    let shader = Shader::new(prepared.setup(), &prepared.illumination, &point.params)?;
    Ok(shaded(&prepared.scene, &shader, samples, &point.gains))
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
