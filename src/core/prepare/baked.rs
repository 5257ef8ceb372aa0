//! A scene with all that is baked of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use web_time::Instant;

use super::{
    Loaded, MovedCamera, Observed, PrepareError, PrepareOptions, Sampled, StageSeconds, registration,
};
use crate::bake::{self, Bake, BakeStats, Illumination, Ranges, SkyBake, VertexOcclusion, VertexThickness};
use crate::engine::view::ObservedView;
use crate::engine::{Point, Task, Unknown};
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::Channels;
use crate::samples::{self, SurfaceBakes, ViewSamples};
use crate::scene::Scene;
use crate::scene::view::View;

/// A scene with its light and occlusion, which are shared with what is made of them: a clone copies none of it.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The scene; its params are those to start from.
    pub scene: Arc<Scene>,
    /// The effects that the parameter file's values were fitted with, where it says.
    pub fitted: Option<Effects>,
    /// A factor on each view's image.
    pub gains: Vec<Gain>,
    /// The cubes that its effects ask for.
    pub illumination: Arc<Illumination>,
    /// Ambient occlusion, when asked for.
    pub occlusion: Option<Arc<VertexOcclusion>>,
    /// The sky that each vertex sees, when asked for.
    pub sky: Option<Arc<SkyBake>>,
    /// How thick the mesh is below each vertex, when asked for.
    pub thickness: Option<Arc<VertexThickness>>,
    /// The folder of the bakes that are kept.
    pub cache: Option<PathBuf>,
    /// The cameras that were moved to where the targets show the mesh, if the fit is to.
    pub cameras: Vec<MovedCamera>,
    /// What was baked, and what came from the cache.
    pub stats: BakeStats,
    /// Seconds by stage so far.
    pub seconds: StageSeconds,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Baked {
    /// Read and bake the scene at `path`; no surface is sampled.
    ///
    /// # Errors
    /// The first stage's that refuses its input.
    pub fn new(path: &Path, options: &PrepareOptions) -> Result<Self, PrepareError> {
        Loaded::read(path, options)?.bake()
    }

    pub(super) fn of(loaded: Loaded) -> Result<Self, PrepareError> {
        let start = Instant::now();
        let Loaded { scene, fitted, gains, seconds, mut warnings, asked } = loaded;
        let ranges = Ranges::of(&scene, asked.fit);
        let cache = asked.cache.as_deref();
        let (baked, stats) = if asked.light_alone {
            let (illumination, stats) = bake::bake_light(&scene, &ranges, cache)?;
            (Bake { illumination, ..Bake::default() }, stats)
        } else {
            let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
            bake::bake(&scene, &pose, &ranges, cache)?
        };
        let (occlusion, sky) = (baked.occlusion.map(Arc::new), baked.sky.map(Arc::new));
        let thickness = baked.thickness.map(Arc::new);
        warnings.extend(stats.warnings.iter().cloned());
        let seconds = StageSeconds { bake: start.elapsed().as_secs_f64(), ..seconds };
        let (scene, illumination) = (Arc::new(scene), Arc::new(baked.illumination));
        let cameras = Vec::new();
        let mut baked = Self {
            scene,
            fitted,
            gains,
            illumination,
            occlusion,
            sky,
            thickness,
            cache: asked.cache.clone(),
            cameras,
            stats,
            seconds,
            warnings,
        };
        if asked.fit && baked.scene.fit.cameras {
            let start = Instant::now();
            baked.cameras = registration::register(&mut baked)?;
            baked.seconds.samples += start.elapsed().as_secs_f64();
            let path = baked.scene.path.display().to_string();
            baked.warnings.extend(baked.cameras.iter().map(|camera| camera.told(&path)));
        }
        Ok(baked)
    }

    /// The same bakes of a scene that differs in what they do not depend on, such as constants (a lobe's exponent within
    /// those that are baked), targets, or what is free.
    #[must_use]
    pub fn with_scene(mut self, change: impl FnOnce(&mut Scene)) -> Self {
        change(Arc::make_mut(&mut self.scene));
        self
    }

    /// What is baked of the surface, for samples of it.
    #[must_use]
    pub fn surface_bakes(&self) -> SurfaceBakes<'_> {
        let (occlusion, sky) = (self.occlusion.as_deref(), self.sky.as_deref());
        let (thickness, cache) = (self.thickness.as_deref(), self.cache.as_deref());
        SurfaceBakes { occlusion, sky, thickness, cache, ..SurfaceBakes::default() }
    }

    /// Trace the visible surface of each view.
    ///
    /// # Errors
    /// When a view sees nothing of the mesh, or the mesh lacks what the effects ask for.
    pub fn sample(self) -> Result<Sampled, PrepareError> {
        let start = Instant::now();
        let posed = self.scene.mesh.pose();
        let samples = samples::sample_views(&self.scene, &posed, self.surface_bakes())?;
        // Of views that were held out, some were spent before.
        let samples_so_far = self.seconds.samples + start.elapsed().as_secs_f64();
        let seconds = StageSeconds { samples: samples_so_far, ..self.seconds };
        Ok(Sampled { baked: Self { seconds, ..self }, samples })
    }

    /// Without the views that have no target: a warning names each.
    ///
    /// # Errors
    /// When no view has one.
    pub fn keep_targets(mut self) -> Result<Self, PrepareError> {
        let has_target: Vec<bool> = self.scene.views.iter().map(|view| view.target.is_some()).collect();
        if !has_target.contains(&true) {
            return Err(PrepareError::NoTarget { scene: self.scene.path.display().to_string() });
        }
        let without = self.scene.views.iter().filter(|view| view.target.is_none());
        let path = self.scene.path.display();
        let warning = |view: &View| {
            format!("{path}: view \"{}\" has no target and takes no part in the fit.", view.name)
        };
        self.warnings.extend(without.map(warning));
        self.gains = kept(self.gains, &has_target);
        // A scene that is shared is not copied for nothing.
        if has_target.contains(&false) {
            return Ok(self.with_scene(|scene| scene.views.retain(|view| view.target.is_some())));
        }
        Ok(self)
    }

    /// The views that have a target beside what was observed there, with `samples` of all views.
    ///
    /// # Errors
    /// When no view has a target, or no pixel of a target counts.
    pub fn observe(self, samples: Vec<ViewSamples>) -> Result<Observed, PrepareError> {
        let has_target: Vec<bool> = self.scene.views.iter().map(|view| view.target.is_some()).collect();
        Observed::of(self.keep_targets()?, kept(samples, &has_target))
    }

    /// Where a fit starts.
    #[must_use]
    pub fn start(&self) -> Point {
        Point { params: self.scene.params.clone(), gains: self.gains.clone() }
    }

    /// Pixels in a row of each view's image.
    #[must_use]
    pub fn image_widths(&self) -> Vec<usize> {
        self.scene.views.iter().map(|view| view.camera.width as usize).collect()
    }

    /// The switches of the model.
    #[must_use]
    pub fn setup(&self) -> Setup {
        self.scene.setup()
    }

    /// The unknowns of the scene's fit: free columns, then free gains (of a view whose gain starts at three values, or with
    /// its white balance, one a channel).
    #[must_use]
    pub fn unknowns(&self) -> Vec<Unknown> {
        let fit = &self.scene.fit;
        let gains = |view: usize| -> Vec<Unknown> {
            let alike = self.gains.get(view).copied().unwrap_or_default().scalar().is_some();
            match (fit.free_gains, fit.white_balance) {
                (false, false) => Vec::new(),
                (true, false) if alike => vec![Unknown::Gain(view, Channels::Tied)],
                _ => [0, 1, 2].map(|c| Unknown::Gain(view, Channels::One(c))).to_vec(),
            }
        };
        let columns = fit.free.iter().copied().map(Unknown::Param);
        columns.chain((1..self.scene.views.len()).flat_map(gains)).collect()
    }

    /// The scene's fit over other views than its own.
    #[must_use]
    pub fn task_over(&self, views: impl Into<Arc<[ObservedView]>>) -> Task {
        Task {
            setup: self.setup(),
            illumination: Arc::clone(&self.illumination),
            views: views.into(),
            loss: self.scene.fit.loss,
            unknowns: self.unknowns(),
        }
    }
}

/// Those of a list that are marked.
fn kept<T>(list: Vec<T>, marked: &[bool]) -> Vec<T> {
    list.into_iter().zip(marked).filter_map(|(item, marked)| marked.then_some(item)).collect()
}
