//! A scene's views beside what was observed there.

use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

use super::{Baked, PrepareError, PrepareOptions, Sampled, silhouettes};
use crate::engine::Task;
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::samples::{TargetRows, ViewSamples};
use crate::scene::view::View;

/// A scene of views that have a target, ready to be fitted.
#[derive(Clone, Debug)]
pub struct Observed {
    /// The scene and its bakes; each of its views has a target.
    pub baked: Baked,
    /// Those views: their samples and targets.
    pub views: Arc<[ObservedView]>,
}

impl Observed {
    /// Read, bake and sample the scene at `path` for a fit of its views that have a target, whether or not the options
    /// speak of a fit.
    ///
    /// # Errors
    /// The first stage's that refuses its input.
    pub fn new(path: &Path, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let options = PrepareOptions { fit: true, ..options.clone() };
        Sampled::new(path, &options)?.observe()
    }

    /// Of views all of which have a target, with their samples. Silhouettes that lie apart are a warning.
    pub(super) fn of(mut baked: Baked, samples: Vec<ViewSamples>) -> Result<Self, PrepareError> {
        let scene = &baked.scene;
        let apart = silhouettes::warnings(&scene.path.display().to_string(), &scene.views, &samples);
        let views = beside(&scene.path, &scene.views, samples)?;
        baked.warnings.extend(apart);
        Ok(Self { baked, views: views.into() })
    }

    /// The scene's fit.
    #[must_use]
    pub fn task(&self) -> Task {
        self.task_over(Arc::clone(&self.views))
    }

    /// The CPU engine for it.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn engine(&self) -> Result<CpuEngine, PrepareError> {
        let scene = || self.scene.path.display().to_string();
        CpuEngine::new(self.task()).map_err(|error| PrepareError::Shading { scene: scene(), error })
    }
}

impl Deref for Observed {
    type Target = Baked;

    fn deref(&self) -> &Baked {
        &self.baked
    }
}

/// The samples of views beside their targets; `scene` is the file that they stand in.
pub(super) fn beside(
    scene: &Path,
    views: &[View],
    samples: Vec<ViewSamples>,
) -> Result<Vec<ObservedView>, PrepareError> {
    let scene = || scene.display().to_string();
    let one = |(view, samples): (&View, ViewSamples)| {
        let TargetRows { channels, weight, clip } = TargetRows::new(view, &samples)
            .map_err(|error| PrepareError::Target { scene: scene(), error })?
            .ok_or_else(|| PrepareError::NoTarget { scene: scene() })?;
        Ok(ObservedView { samples, target: channels, weight, clip })
    };
    views.iter().zip(samples).map(one).collect()
}
