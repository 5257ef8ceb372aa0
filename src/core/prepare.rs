//! The stages before a fit or a render, run once and timed: scene -> bake -> samples.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use web_time::Instant;

use crate::bake::rays::any_can_be_hit;
use crate::bake::{self, BakeError, BakeStats, Illumination, VertexOcclusion};
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::engine::{Point, Task, Unknown};
use crate::fit::params_file::{ParamsFile, ParamsFileError};
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Column, Param, Params};
use crate::program::shading::ShadingError;
use crate::samples::{self, SampleError, TargetRows, ViewSamples};
use crate::scene::error::SceneError;
use crate::scene::load::LoadOptions;
use crate::scene::suggestion;
use crate::scene::view::{Background, View};
use crate::scene::{Assignment, Scene};

/// What a command asks of the stages.
#[derive(Clone, Debug, Default)]
pub struct PrepareOptions {
    /// Instead of the scene's effects.
    pub effects: Option<Effects>,
    /// Whether targets are read, as a fit needs them; then all lobes are baked of which the fit can
    /// make use, and otherwise the start value's alone.
    pub fit: bool,
    /// Which views.
    pub views: Views,
    /// A parameter file to take parameters and gains from, instead of the scene's start values.
    pub params: Option<PathBuf>,
    /// Values instead of the scene's and the parameter file's.
    pub set: Vec<Assignment>,
    /// Where bakes are kept between runs.
    pub cache: Option<PathBuf>,
    /// Seconds into animation 0, instead of the scene's.
    pub time: Option<f64>,
    /// That the mesh will go through animation 0, and how its occlusion follows.
    pub clip: Option<ClipOcclusion>,
    /// Instead of the views' backgrounds.
    pub background: Option<Background>,
}

/// How ambient occlusion follows an animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipOcclusion {
    /// By what is baked once for each morph target that the animation moves (the paper's way).
    Targets,
    /// By a bake of every frame, which its caller makes (`bake::bake_pose`).
    Frames,
}

/// Seconds spent in each stage of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct StageSeconds {
    /// Reading the scene.
    pub load: f64,
    /// Cube maps and ambient occlusion (or reading them from the cache).
    pub bake: f64,
    /// Tracing the visible surface.
    pub samples: f64,
    /// Fitting whole maps, where they are.
    pub maps: f64,
    /// Fitting the constants.
    pub fit: f64,
    /// Rendering what the report shows.
    pub render: f64,
    /// Scores, pictures and files of the report, up to its page.
    pub report: f64,
}

/// Which of a scene's views are wanted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Views {
    /// Every one.
    #[default]
    All,
    /// The first.
    First,
    /// The one of this name.
    Named(String),
}

/// A scene that is ready to be evaluated. Scene and bakes are shared with what is made of them.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The scene; its params are those to start from.
    pub scene: Arc<Scene>,
    /// The effects that the parameter file's values were fitted with, where it says.
    pub fitted: Option<Effects>,
    /// A factor on each view's image.
    pub gains: Vec<f64>,
    /// The cubes that its effects ask for.
    pub illumination: Arc<Illumination>,
    /// Ambient occlusion, when asked for.
    pub occlusion: Option<Arc<VertexOcclusion>>,
    /// The visible surface, a view each.
    pub samples: Vec<ViewSamples>,
    /// What was baked, and what came from the cache.
    pub baked: BakeStats,
    /// Seconds by stage so far.
    pub seconds: StageSeconds,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A stage refused its input.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant is the stage's own error")]
pub enum PrepareError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Bake(#[from] BakeError),
    #[error(transparent)]
    Samples(#[from] SampleError),
    #[error(transparent)]
    Params(#[from] ParamsFileError),
    /// A view that cannot be compared with its target.
    #[error("{scene}: {error}")]
    Target { scene: String, error: SampleError },
    /// What posing leaves of the mesh.
    #[error(
        "{scene}: no triangle of the mesh has an area once it is posed: node scales, bones or morph weights draw it \
         together. Correct them in the mesh file, or the scene's morph_weights and time."
    )]
    Collapsed { scene: String },
    /// Rules that the processor cannot compute.
    #[error("{scene}: {error}.")]
    Shading { scene: String, error: ShadingError },
    /// No view of that name.
    #[error("{scene}: there is no view `{view}`. {suggestion}.")]
    NoView { scene: String, view: String, suggestion: String },
    /// A fit without anything to match.
    #[error(
        "{scene}: no view names a target, so there is nothing to fit. Add target = \"image.exr\" to a [[view]]."
    )]
    NoTarget { scene: String },
}

impl Prepared {
    /// Read, bake and sample the scene at `path`.
    ///
    /// # Errors
    /// The first stage's that refuses its input.
    pub fn new(path: &Path, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let mut prepared = Self::baked(path, options)?;
        let start = Instant::now();
        prepared.samples = prepared.traced()?;
        prepared.seconds.samples = start.elapsed().as_secs_f64();
        Ok(prepared)
    }

    /// The visible surface of each view, by rays.
    ///
    /// # Errors
    /// When a view sees nothing of the mesh, or the mesh lacks what the effects ask for.
    pub fn traced(&self) -> Result<Vec<ViewSamples>, SampleError> {
        samples::sample_views(&self.scene, &self.scene.mesh.pose(), self.occlusion.as_deref())
    }

    /// Read and bake the scene at `path`; no surface is sampled.
    ///
    /// # Errors
    /// The first stage's that refuses its input.
    pub fn baked(path: &Path, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let start = Instant::now();
        let load = LoadOptions {
            effects: options.effects,
            targets: options.fit,
            time: options.time,
            clip: options.clip == Some(ClipOcclusion::Targets),
            background: options.background,
        };
        let (mut scene, warnings) = Scene::load(path, &load)?;
        // An animation may begin with nothing and go on with something.
        if options.time.is_none() {
            check_area(&scene)?;
        }
        choose_views(&mut scene, &options.views)?;
        let (mut gains, mut fitted) = (vec![1.0; scene.views.len()], None);
        if let Some(path) = &options.params {
            let file = ParamsFile::read(path, scene.form, &scene.params)?;
            (scene.params, fitted) = (file.params, file.effects);
            for (gain, view) in gains.iter_mut().zip(&scene.views) {
                let given = file.gains.iter().find(|(name, _)| *name == view.name);
                *gain = given.map_or(1.0, |&(_, gain)| gain);
            }
        }
        options.set.iter().for_each(|assignment| assignment.apply(&mut scene.params));
        scene.fit.free = untied(&scene.fit.free, &scene.params, &options.set);
        let mut prepared = Self {
            scene: Arc::new(scene),
            fitted,
            gains,
            illumination: Arc::default(),
            occlusion: None,
            samples: Vec::new(),
            baked: BakeStats::default(),
            seconds: StageSeconds { load: start.elapsed().as_secs_f64(), ..StageSeconds::default() },
            warnings: warnings.iter().map(ToString::to_string).collect(),
        };
        let lobe = Param::SpecularLobe.info();
        let free = prepared.scene.fit.free.iter().any(|column| column.param == lobe.param);
        let start = prepared.scene.params.scalar(lobe.param);
        let exponents = if options.fit && free { lobe.lower..=lobe.upper } else { start..=start };
        if options.clip == Some(ClipOcclusion::Frames) {
            prepared.bake_light(exponents, options.cache.as_deref())?;
        } else {
            prepared.bake(exponents, options.cache.as_deref())?;
        }
        Ok(prepared)
    }

    /// Bake what the effects ask for, with the lobes around `exponents`.
    ///
    /// # Errors
    /// When the scene lacks what its effects ask for.
    pub fn bake(&mut self, exponents: RangeInclusive<f64>, cache: Option<&Path>) -> Result<(), PrepareError> {
        let start = Instant::now();
        let mesh = &self.scene.mesh;
        let pose = |weights: &[f32]| mesh.pose_with_weights(weights);
        let (bake, baked) = bake::bake(&self.scene, &pose, exponents, cache)?;
        self.occlusion = bake.occlusion.map(Arc::new);
        self.take_light(bake.illumination, baked, start);
        Ok(())
    }

    fn bake_light(
        &mut self,
        exponents: RangeInclusive<f64>,
        cache: Option<&Path>,
    ) -> Result<(), PrepareError> {
        let start = Instant::now();
        let (illumination, baked) = bake::bake_light(&self.scene, exponents, cache)?;
        self.take_light(illumination, baked, start);
        Ok(())
    }

    fn take_light(&mut self, illumination: Illumination, baked: BakeStats, start: Instant) {
        self.warnings.extend(baked.warnings.iter().cloned());
        self.baked = baked;
        self.illumination = Arc::new(illumination);
        self.seconds.bake += start.elapsed().as_secs_f64();
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

    /// The unknowns of the scene's fit: free columns, then free gains.
    #[must_use]
    pub fn unknowns(&self) -> Vec<Unknown> {
        let gains = if self.scene.fit.free_gains { self.scene.views.len() } else { 0 };
        let columns = self.scene.fit.free.iter().copied().map(Unknown::Param);
        columns.chain((1..gains).map(Unknown::Gain)).collect()
    }

    /// The CPU engine over the views that have a target; views without one are dropped from the scene.
    ///
    /// # Errors
    /// As of [`Self::observed`] and [`Self::engine_over`].
    pub fn engine(&mut self) -> Result<CpuEngine, PrepareError> {
        let observed = self.observed()?;
        self.engine_over(observed)
    }

    /// The CPU engine over views that [`Self::observed`] gave.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn engine_over(&self, observed: impl Into<Arc<[ObservedView]>>) -> Result<CpuEngine, PrepareError> {
        CpuEngine::new(self.task(observed))
            .map_err(|error| PrepareError::Shading { scene: self.scene.path.display().to_string(), error })
    }

    /// The scene's fit over views that [`Self::observed`] gave.
    #[must_use]
    pub fn task(&self, observed: impl Into<Arc<[ObservedView]>>) -> Task {
        Task {
            setup: self.setup(),
            illumination: Arc::clone(&self.illumination),
            views: observed.into(),
            loss: self.scene.fit.loss,
            unknowns: self.unknowns(),
        }
    }

    /// The views that have a target, with their samples; views without one are dropped from the scene.
    ///
    /// # Errors
    /// When no view has a target, or a target asks nothing.
    pub fn observed(&mut self) -> Result<Vec<ObservedView>, PrepareError> {
        self.keep_targets()?;
        let samples = std::mem::take(&mut self.samples);
        self.observed_with(samples)
    }

    /// Drop the views that have no target from the scene, with a warning each.
    ///
    /// # Errors
    /// When no view has one.
    pub fn keep_targets(&mut self) -> Result<(), PrepareError> {
        let has_target: Vec<bool> = self.scene.views.iter().map(|view| view.target.is_some()).collect();
        let without = self.scene.views.iter().filter(|view| view.target.is_none());
        let path = self.scene.path.display();
        let warning = |view: &View| {
            format!("{path}: view \"{}\" has no target and takes no part in the fit.", view.name)
        };
        self.warnings.extend(without.map(warning));
        retain(&mut Arc::make_mut(&mut self.scene).views, &has_target);
        retain(&mut self.gains, &has_target);
        retain(&mut self.samples, &has_target);
        if self.scene.views.is_empty() {
            return Err(PrepareError::NoTarget { scene: self.scene.path.display().to_string() });
        }
        Ok(())
    }

    /// The scene's views, all of which have a target, with these samples.
    ///
    /// # Errors
    /// When a target asks nothing.
    pub fn observed_with(&self, samples: Vec<ViewSamples>) -> Result<Vec<ObservedView>, PrepareError> {
        let scene = || self.scene.path.display().to_string();
        let mut observed = Vec::with_capacity(samples.len());
        for (view, samples) in self.scene.views.iter().zip(samples) {
            let target = TargetRows::new(view, &samples)
                .map_err(|error| PrepareError::Target { scene: scene(), error })?
                .ok_or_else(|| PrepareError::NoTarget { scene: scene() })?;
            observed.push(observe(samples, target));
        }
        Ok(observed)
    }
}

/// Refuse a mesh of which posing leaves nothing: at rest the reader has seen to it, but bones and morph targets may
/// draw all of it together.
fn check_area(scene: &Scene) -> Result<(), PrepareError> {
    let posed = scene.mesh.pose();
    match any_can_be_hit(&posed.positions, &posed.triangles) {
        true => Ok(()),
        false => Err(PrepareError::Collapsed { scene: scene.path.display().to_string() }),
    }
}

/// Keep what is marked; a list that is empty stays so.
fn retain<T>(list: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    list.retain(|_| kept.next().copied().unwrap_or(true));
}

fn observe(samples: ViewSamples, target: TargetRows) -> ObservedView {
    ObservedView { samples, target: target.channels, weight: target.weight, clip: target.clip }
}

/// The free columns, with one a channel for each parameter whose start has three different values (a tied column would
/// begin by throwing two of them away), or that was set to three.
fn untied(free: &[Column], start: &Params, set: &[Assignment]) -> Vec<Column> {
    let coloured = |param: Param| {
        let [r, g, b] = start.rgb(param);
        r != g || g != b || set.iter().any(|assignment| assignment.param == param && assignment.coloured)
    };
    let split = |column: &Column| match column.channels {
        Channels::Tied if coloured(column.param) => Column::per_channel(column.param).to_vec(),
        _ => vec![*column],
    };
    free.iter().flat_map(split).collect()
}

fn choose_views(scene: &mut Scene, wanted: &Views) -> Result<(), PrepareError> {
    match wanted {
        Views::All => {}
        Views::First => scene.views.truncate(1),
        Views::Named(name) => {
            if !scene.views.iter().any(|view| view.name == *name) {
                let known: Vec<&str> = scene.views.iter().map(|view| view.name.as_str()).collect();
                return Err(PrepareError::NoView {
                    scene: scene.path.display().to_string(),
                    view: name.clone(),
                    suggestion: suggestion(name, &known),
                });
            }
            scene.views.retain(|view| view.name == *name);
        }
    }
    Ok(())
}
