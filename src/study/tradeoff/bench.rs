//! A scene at other settings: baked, sampled and shaded, all else being equal.

use std::path::{Path, PathBuf};

use crate::StudyError;
use crate::bake::{self, Illumination};
use crate::engine::Point;
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::model::effects::Silhouette;
use crate::model::evaluate::Setup;
use crate::model::params::Param;
use crate::prepare::{PrepareError, PrepareOptions, Prepared};
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::rows::Rows;
use crate::samples::{self, ViewSamples};
use crate::scene::{Loss, Quality, Scene};
use crate::subject::shaded;

/// The settings that a scene file can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// `[model] silhouette`
    pub silhouette: Silhouette,
    /// `[quality]`
    pub quality: Quality,
}

/// A scene, to be evaluated at any settings.
pub struct Bench<'a> {
    /// Its file.
    pub path: &'a Path,
    /// As it stands, loaded and baked, with its own samples.
    pub prepared: Prepared,
    /// The parameter file, if any.
    pub params: Option<&'a Path>,
    cache: Option<PathBuf>,
}

/// A scene at some settings.
pub struct Evaluated {
    /// The scene, with the settings.
    pub scene: Scene,
    /// Its cubes.
    pub illumination: Illumination,
    /// Its visible surface, a view each.
    pub samples: Vec<ViewSamples>,
}

impl<'a> Bench<'a> {
    /// Load, bake and sample a scene as it stands.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn new(path: &'a Path, params: Option<&'a Path>, cache: Option<&Path>) -> Result<Self, StudyError> {
        let options = PrepareOptions {
            fit: true,
            params: params.map(Path::to_owned),
            cache: cache.map(Path::to_owned),
            ..PrepareOptions::default()
        };
        let prepared = Prepared::new(path, &options)?;
        Ok(Self { path, prepared, params, cache: options.cache })
    }

    /// Where bakes are kept.
    #[must_use]
    pub fn cache(&self) -> Option<&Path> {
        self.cache.as_deref()
    }

    /// The scene's own settings.
    #[must_use]
    pub fn settings(&self) -> Settings {
        Settings { silhouette: self.prepared.scene.silhouette, quality: self.prepared.scene.quality }
    }

    /// The scene's constants and gains.
    #[must_use]
    pub fn point(&self) -> Point {
        self.prepared.start()
    }

    /// How a fit's engine is asked for, of the scene as it stands and from its own start values: constants of an
    /// earlier fit would be the answer already.
    #[must_use]
    pub fn fit_options(&self) -> PrepareOptions {
        PrepareOptions { fit: true, cache: self.cache.clone(), ..PrepareOptions::default() }
    }

    /// The scene with these settings.
    #[must_use]
    pub fn scene(&self, settings: Settings) -> Scene {
        let mut scene = self.prepared.scene.clone();
        (scene.silhouette, scene.quality) = (settings.silhouette, settings.quality);
        scene
    }

    /// Bake and sample the scene at these settings. Bakes come from the cache where they are there.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn evaluate(&self, settings: Settings) -> Result<Evaluated, StudyError> {
        let scene = self.scene(settings);
        let (bake, _) = baked(&scene, &scene, self.cache.as_deref())?;
        let posed = scene.mesh.pose();
        let samples =
            samples::sample_views(&scene, &posed, bake.occlusion.as_ref()).map_err(PrepareError::from)?;
        Ok(Evaluated { scene, illumination: bake.illumination, samples })
    }
}

/// Bake what the effects of `scene` ask for at the constants of `at`.
///
/// # Errors
/// When the scene lacks what its effects ask for.
pub fn baked(
    scene: &Scene,
    at: &Scene,
    cache: Option<&Path>,
) -> Result<(bake::Bake, bake::BakeStats), StudyError> {
    let exponent = at.params.scalar(Param::SpecularLobe);
    let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
    Ok(bake::bake(scene, &pose, exponent..=exponent, cache).map_err(PrepareError::from)?)
}

impl Evaluated {
    /// The switches of the model.
    #[must_use]
    pub fn setup(&self) -> Setup {
        let Scene { form, silhouette, effects, .. } = self.scene;
        Setup { form, silhouette, effects }
    }

    /// The f64 shader at these settings.
    #[must_use]
    pub fn shader(&self, point: &Point) -> Shader {
        Shader::new(self.setup(), &self.illumination, &point.params)
    }

    /// The image of each view.
    #[must_use]
    pub fn images(&self, point: &Point) -> Vec<Image> {
        let samples: Vec<&ViewSamples> = self.samples.iter().collect();
        shaded(&self.scene, &self.shader(point), &samples, &point.gains)
    }

    /// An engine over the samples that does every lookup anew, as a renderer does; its targets are black.
    #[must_use]
    pub fn live_engine(&self) -> CpuEngine {
        let observed = |samples: &ViewSamples| ObservedView {
            target: Rows::new(3, samples.groups()),
            samples: samples.clone(),
            ..ObservedView::default()
        };
        let views = self.samples.iter().map(observed).collect();
        CpuEngine::with_kept_terms(
            self.setup(),
            self.illumination.clone(),
            views,
            Loss::L2,
            Vec::new(),
            false,
        )
    }
}
