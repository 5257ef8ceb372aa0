//! How good a set of effects is: each view scored by a fit of the others.

use std::path::Path;
use std::sync::Arc;

use crate::StudyError;
use crate::engine::Point;
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::fit::{self, FitOptions};
use crate::model::effects::Effects;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param};
use crate::prepare::{Baked, Loaded, PrepareOptions, untied};
use crate::reference::ReferenceView;
use crate::shader::{Budget, plan};
use crate::subject::Subject;

/// Most folds: one for each view, or for each part of the views where there are more.
const MOST_FOLDS: usize = 6;

/// Views count as alike from this PSNR on, in dB: a sixteenth of a step of 8 bits. What a set gains beyond is nothing.
const ALIKE: f64 = 72.0;

/// What sets are judged by.
pub struct Judge<'a> {
    /// The scene file.
    pub scene: &'a Path,
    /// How it is prepared.
    pub prepare: PrepareOptions,
}

/// What a fit found.
pub struct Fitted {
    /// Its end.
    pub point: Point,
}

impl Judge<'_> {
    /// Mean PSNR in dB over the views, each scored by a fit of those outside its fold, and operations a fragment of the
    /// renderer. Pixels have one sample: sets are compared, and all of them alike.
    ///
    /// # Errors
    /// When a stage refuses its input, or a fit cannot be done.
    pub fn score(&self, effects: Effects) -> Result<(f64, f64), StudyError> {
        let subject = self.subject(effects, Some(1))?;
        let only = subject.scenes.first();
        let (baked, views) = (&only.baked, subject.scenes.views(only));
        let folds = views.len().min(MOST_FOLDS);
        let mut scores = Vec::new();
        for fold in 0..folds {
            let held = |i: usize| i * folds / views.len() == fold;
            let seen: Vec<ObservedView> =
                (0..views.len()).filter(|&i| !held(i)).map(|i| views[i].clone()).collect();
            let gains = |of: &dyn Fn(usize) -> bool| -> Vec<Gain> {
                (0..views.len())
                    .filter(|&i| of(i))
                    .map(|i| baked.gains.get(i).copied().unwrap_or_default())
                    .collect()
            };
            let point = self.fit_views(baked, seen.into(), gains(&|i| !held(i)))?;
            // What the fit found, on every view.
            let everywhere = Point { params: point.params, gains: gains(&|_| true) };
            let images = subject.images(&everywhere)?;
            for i in (0..views.len()).filter(|&i| held(i)) {
                let reference = ReferenceView::new(&baked.scene.views[i], &views[i]);
                let errors = reference.errors(&images[i], baked.scene.fit.loss);
                scores.extend(errors.scores.map(|scores| scores.psnr.min(ALIKE)));
            }
        }
        let scene = &baked.scene;
        let planned = plan(&scene.facts(&scene.params, Budget::Exact, false))?;
        let mean = scores.iter().sum::<f64>() / scores.len().max(1) as f64;
        Ok((mean, planned.cost))
    }

    /// The scene with those effects, all of its views, as finely sampled as it says.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn whole(&self, effects: Effects) -> Result<Subject, StudyError> {
        self.subject(effects, None)
    }

    /// A fit to all views.
    ///
    /// # Errors
    /// When it cannot be done.
    pub fn fit(&self, subject: &Subject) -> Result<Fitted, StudyError> {
        Ok(Fitted { point: subject.fit(&FitOptions::default())?.end })
    }

    fn fit_views(
        &self,
        baked: &Baked,
        views: Arc<[ObservedView]>,
        gains: Vec<Gain>,
    ) -> Result<Point, StudyError> {
        let engine = CpuEngine::new(baked.task_over(views))?;
        let start = Point { gains, ..baked.start() };
        let bounds = vec![baked.scene.fit.bounds.clone()];
        let options = FitOptions { bounds, effects: Some(baked.scene.effects), ..FitOptions::default() };
        let outcome = fit::fit(&engine, &start, &options, &mut |_| {});
        let scene = || self.scene.display().to_string();
        Ok(outcome.map_err(|error| StudyError::Fit { scene: scene(), error })?.end)
    }

    fn subject(&self, effects: Effects, samples: Option<u32>) -> Result<Subject, StudyError> {
        let prepare = PrepareOptions { effects: Some(effects), ..self.prepare.clone() };
        let change = |loaded: &mut Loaded| {
            let scene = &mut loaded.scene;
            (scene.fit.free_gains, scene.fit.white_balance) = (false, false);
            scene.fit.free = untied(&free(effects, &scene.fit.free), &scene.params, &[]);
            // What is free of a set is chosen here: what else the scene frees is not to be warned of.
            loaded.warnings.retain(|warning| !warning.contains("no enabled effect asks for it"));
            let scene = &mut loaded.scene;
            if let Some(samples) = samples {
                scene.quality.samples_per_axis = samples;
            }
        };
        Subject::new(self.scene, &prepare, change)
    }
}

/// What is free of a set: what the scene frees of it, and the weights of those effects of which it frees nothing.
fn free(effects: Effects, own: &[Column]) -> Vec<Column> {
    let mut free: Vec<Column> =
        own.iter().copied().filter(|column| column.param.asked_for(effects)).collect();
    let spoken_for = |param: Param| {
        let of = param.info().effects;
        own.iter().any(|column| column.param.info().effects.iter().any(|effect| of.contains(effect)))
    };
    let weights = Param::of(effects).filter(|param| {
        let info = param.info();
        info.linear && !info.held && !param.is_of_scene() && param.asked_for(effects) && !spoken_for(*param)
    });
    free.extend(weights.map(Column::tied));
    free
}
