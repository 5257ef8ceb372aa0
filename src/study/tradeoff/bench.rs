//! A scene at other settings: baked, sampled and shaded, all else being equal. Its surface is traced once for all
//! settings that do not touch it.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::settings::{Settings, Traced};
use crate::StudyError;
use crate::bake::inward::gathers_inside;
use crate::bake::rays::RayMesh;
use crate::bake::{self, Illumination, Ranges};
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::engine::{Objective, Point, Task};
use crate::model::choices::Choices;
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::model::params::Params;
use crate::prepare::{Baked, Loaded, NamedScene, PrepareError, PrepareOptions, Sampled};
use crate::reference::Difference;
use crate::render::format::FormatShader;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::rows::Rows;
use crate::samples::{self, Atlas, Hit, PosedSurface, SampleError, SurfaceBakes, ViewSamples, sample_hits};
use crate::scene::diffusion::Diffusion;
use crate::scene::names::names_of;
use crate::scene::view::View;
use crate::scene::{Loss, Quality, Scene};
use crate::subject::{SampledScene, shaded};
use crate::timing::seconds_of;

/// The visible surface, a view each.
type Surfaces = Arc<Vec<ViewSamples>>;

/// A scene, to be evaluated at any settings.
pub struct Bench<'a> {
    /// What it is called among several.
    pub name: String,
    /// Its file.
    pub path: &'a Path,
    /// As it stands; its samples are `surfaces`.
    pub baked: Baked,
    /// The parameter file, if any.
    pub params: Option<&'a Path>,
    /// The settings of all scenes of the study, its own among them.
    pub all: Vec<Settings>,
    /// Its samples as it stands.
    surfaces: Surfaces,
    /// Those of the other settings that were evaluated last: one set of them is a good part of the memory.
    last: RefCell<Option<(Traced, Surfaces)>>,
    /// The points that its samples show, once some were made again with another occlusion.
    hits: RefCell<Option<Arc<Vec<Vec<Hit>>>>>,
    /// References that took long to make: axes of one effect have one and the same.
    references: RefCell<Vec<(Chosen, Arc<TimedImages>)>>,
    cache: Option<PathBuf>,
}

/// All that a way to a quantity changes of a scene.
type Chosen = (Choices, Diffusion, Effects, Quality, Params);

/// A scene by other named choices.
#[derive(Debug)]
pub struct TimedImages {
    /// Seconds from nothing to a pass over the samples.
    pub seconds: f64,
    /// An image a view.
    pub images: Vec<Image>,
}

/// How many references are kept: images of all views are a good part of the memory.
const REFERENCES: usize = 3;

/// Seconds of what sweeps are made of, measured on the scene as it stands.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Tracing the surface of all views.
    pub trace: f64,
    /// Their images from samples that are there, compared with others.
    pub images: f64,
    /// A pass of the engine with every lookup live.
    pub pass: f64,
}

/// A scene at some settings.
pub struct Evaluated {
    /// The scene, with the settings.
    pub scene: Scene,
    /// Its cubes.
    pub illumination: Arc<Illumination>,
    /// Its visible surface, a view each.
    pub samples: Surfaces,
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
        let [name, ..] = names_of(path);
        let loaded = Loaded::read(path, &options)?;
        Self::of(path, NamedScene { name, loaded }, params, cache)
    }

    /// Bake and sample a scene that was read from `path`.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn of(
        path: &'a Path,
        NamedScene { name, loaded }: NamedScene,
        params: Option<&'a Path>,
        cache: Option<&Path>,
    ) -> Result<Self, StudyError> {
        let Sampled { baked, samples } = loaded.bake()?.sample()?;
        let surfaces = Arc::new(samples);
        let (last, hits) = (RefCell::default(), RefCell::default());
        let (references, cache) = (RefCell::default(), cache.map(Path::to_owned));
        let mut bench =
            Self { name, path, baked, params, all: Vec::new(), surfaces, last, hits, references, cache };
        bench.all = vec![bench.settings()];
        Ok(bench)
    }

    /// The same scene at other constants, which move neither its mesh nor its samples.
    #[must_use]
    pub fn at(&self, params: Params) -> Self {
        let baked = self.baked.clone().with_scene(|scene| scene.params = params);
        let (surfaces, last, hits) = (Arc::clone(&self.surfaces), RefCell::default(), RefCell::default());
        let (name, all, cache) = (self.name.clone(), self.all.clone(), self.cache.clone());
        Self { name, all, baked, surfaces, last, hits, references: RefCell::default(), cache, ..*self }
    }

    /// Bake, sample and shade the scene by other named choices, nothing cached.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn way(&self, scene: Scene) -> Result<TimedImages, StudyError> {
        let since = Instant::now();
        // A way may bring constants of its own, as a preset does.
        let point = Point { params: scene.params.clone(), ..self.point() };
        let evaluated = Evaluated::anew(scene)?;
        evaluated.live_engine()?.loss(&point);
        Ok(TimedImages { seconds: since.elapsed().as_secs_f64(), images: evaluated.images(&point)? })
    }

    /// The same of what other ways are measured against. Where an earlier axis made it, its images and seconds are those.
    ///
    /// # Errors
    /// As [`Self::way`].
    pub fn reference(&self, scene: Scene) -> Result<Arc<TimedImages>, StudyError> {
        let chosen = (scene.choices, scene.diffusion, scene.effects, scene.quality, scene.params.clone());
        if let Some((_, made)) = self.references.borrow().iter().find(|(of, _)| *of == chosen) {
            return Ok(Arc::clone(made));
        }
        let made = Arc::new(self.way(scene)?);
        let mut known = self.references.borrow_mut();
        if known.len() == REFERENCES {
            known.remove(0);
        }
        known.push((chosen, Arc::clone(&made)));
        Ok(made)
    }

    /// What its sweeps are made of, measured.
    ///
    /// # Errors
    /// When a stage fails.
    pub fn rates(&self) -> Result<Rates, StudyError> {
        let since = Instant::now();
        let evaluated = self.evaluate(self.settings())?;
        let images = evaluated.images(&self.point())?;
        std::hint::black_box(Difference::of_all(&images, &images));
        let images = since.elapsed().as_secs_f64();
        let engine = evaluated.live_engine()?;
        let pass = seconds_of(|| engine.loss(&self.point()));
        Ok(Rates { trace: self.baked.seconds.samples, images, pass })
    }

    /// Where bakes are kept.
    #[must_use]
    pub fn cache(&self) -> Option<&Path> {
        self.cache.as_deref()
    }

    /// The scene's own settings.
    #[must_use]
    pub fn settings(&self) -> Settings {
        Settings { silhouette: self.baked.scene.silhouette, quality: self.baked.scene.quality }
    }

    /// The scene's constants and gains.
    #[must_use]
    pub fn point(&self) -> Point {
        self.baked.start()
    }

    /// The scene as it stands at its own start values, to be fitted but for the marked views: constants of an earlier fit
    /// would be the answer already.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn to_fit(&self, marked: &[bool]) -> Result<SampledScene, StudyError> {
        let baked = match self.params {
            None => self.baked.clone(),
            Some(_) => {
                let options =
                    PrepareOptions { fit: true, cache: self.cache.clone(), ..PrepareOptions::default() };
                let mut loaded = Loaded::read(self.path, &options)?;
                // Samples are those of the cameras that were found.
                loaded.scene.fit.cameras = false;
                let views = self.baked.scene.views.clone();
                loaded.bake()?.with_scene(|scene| scene.views = views)
            }
        };
        let kept = self.surfaces.iter().zip(marked).filter(|(_, marked)| !**marked);
        let samples: Vec<ViewSamples> = kept.map(|(samples, _)| samples.clone()).collect();
        let (baked, held) = baked.hold_out(marked)?;
        Ok(SampledScene { name: self.name.clone(), sampled: Sampled { baked, samples }, held })
    }

    /// The scene with these settings.
    #[must_use]
    pub fn scene(&self, settings: Settings) -> Scene {
        let mut scene = Scene::clone(&self.baked.scene);
        (scene.silhouette, scene.quality) = (settings.silhouette, settings.quality);
        scene
    }

    /// Bake and sample the scene at these settings. Bakes come from the cache where they are there, and samples from
    /// those that are there already.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn evaluate(&self, settings: Settings) -> Result<Evaluated, StudyError> {
        let scene = self.scene(settings);
        let (bake, _) = baked(&scene, &scene, self.cache.as_deref())?;
        let samples = self.surfaces(&scene, settings.into(), (&bake).into())?;
        Ok(Evaluated { scene, illumination: Arc::new(bake.illumination), samples })
    }

    /// As [`Self::evaluate`], with the surface traced anew.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn evaluate_anew(&self, settings: Settings) -> Result<Evaluated, StudyError> {
        let scene = self.scene(settings);
        let (bake, _) = baked(&scene, &scene, self.cache.as_deref())?;
        let samples = Arc::new(traced(&scene, (&bake).into())?);
        Ok(Evaluated { scene, illumination: Arc::new(bake.illumination), samples })
    }

    /// The samples of `scene`, which is this one at other settings.
    fn surfaces(
        &self,
        scene: &Scene,
        settings: Traced,
        bakes: SurfaceBakes<'_>,
    ) -> Result<Surfaces, StudyError> {
        let own = Traced::from(self.settings());
        if settings == own {
            return Ok(Arc::clone(&self.surfaces));
        }
        if let Some((_, surfaces)) = self.last.borrow().as_ref().filter(|(last, _)| *last == settings) {
            return Ok(Arc::clone(surfaces));
        }
        // These go first: there is no need of both.
        self.last.replace(None);
        let occluded = settings.is_but_for_occlusion(own);
        // What is found of the sky, and inside the mesh, follows from as many rays.
        let occluded = occluded && bakes.sky.is_none() && !gathers_inside(scene);
        let made = if occluded { self.occluded(scene, bakes)? } else { traced(scene, bakes)? };
        let surfaces = Arc::new(made);
        self.last.replace(Some((settings, Arc::clone(&surfaces))));
        Ok(surfaces)
    }

    /// The scene's own samples with another occlusion: what they show stays.
    fn occluded(&self, scene: &Scene, bakes: SurfaceBakes<'_>) -> Result<Vec<ViewSamples>, StudyError> {
        let mesh = &scene.mesh;
        let open = samples::posed_occlusion(scene, &mesh.morphs, mesh.positions.len(), bakes.occlusion);
        let mut surfaces = self.surfaces.to_vec();
        let Some(open) = open.map_err(PrepareError::from)? else { return Ok(surfaces) };
        // Texels of the atlas see the same occlusion.
        let atlas = atlas(scene, bakes).map_err(PrepareError::from)?;
        let hits = self.hits(scene);
        for (samples, hits) in surfaces.iter_mut().zip(hits.iter()) {
            samples.atlas.clone_from(&atlas);
            let Some(place) = samples.surface.places().occlusion else { continue };
            let corners = |hit: &Hit| mesh.triangles[hit.triangle as usize].map(|i| open[i as usize]);
            // As `samples` interpolates a number of the vertices.
            let at = |hit: &Hit| -> f32 {
                let (weights, corners) = (hit.weights(), corners(hit));
                (0..3).map(|i| weights[i] * corners[i]).sum()
            };
            samples.surface.rows_mut().plane_mut(place).zip(hits).for_each(|(open, hit)| *open = at(hit));
        }
        Ok(surfaces)
    }

    /// The point of the mesh that each of the scene's own samples shows.
    fn hits(&self, scene: &Scene) -> Arc<Vec<Vec<Hit>>> {
        let traced = || {
            let posed = scene.mesh.pose();
            let rays = RayMesh::of(&posed);
            let of = |view: &View| sample_hits(scene, &posed, &rays, &view.camera);
            Arc::new(scene.views.iter().map(of).collect())
        };
        Arc::clone(self.hits.borrow_mut().get_or_insert_with(traced))
    }
}

/// The texels that effects of a scene are computed in.
fn atlas(scene: &Scene, bakes: SurfaceBakes<'_>) -> Result<Option<Arc<Atlas>>, SampleError> {
    let posed = scene.mesh.pose();
    let rays = RayMesh::of(&posed);
    samples::atlas_of(scene, &PosedSurface::new(scene, &posed, &rays, &scene.mesh.morphs, bakes)?)
}

/// The visible surface of each view of a scene, by rays.
fn traced(scene: &Scene, bakes: SurfaceBakes<'_>) -> Result<Vec<ViewSamples>, StudyError> {
    Ok(samples::sample_views(scene, &scene.mesh.pose(), bakes).map_err(PrepareError::from)?)
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
    let ranges = Ranges::of(at, false);
    let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
    Ok(bake::bake(scene, &pose, &ranges, cache).map_err(PrepareError::from)?)
}

impl Evaluated {
    /// A scene baked and sampled without a cache.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn anew(scene: Scene) -> Result<Self, StudyError> {
        let (bake, _) = baked(&scene, &scene, None)?;
        let samples = Arc::new(traced(&scene, (&bake).into())?);
        Ok(Self { scene, illumination: Arc::new(bake.illumination), samples })
    }

    /// The switches of the model.
    #[must_use]
    pub fn setup(&self) -> Setup {
        self.scene.setup()
    }

    /// The shader of number formats at these settings.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn format_shader(&self, point: &Point) -> Result<FormatShader, StudyError> {
        Ok(FormatShader::new(self.setup(), &self.illumination, &point.params)?)
    }

    /// The image of each view.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn images(&self, point: &Point) -> Result<Vec<Image>, StudyError> {
        let samples: Vec<&ViewSamples> = self.samples.iter().collect();
        let shader = Shader::new(self.setup(), &self.illumination, &point.params)?;
        Ok(shaded(&self.scene, &self.scene.views, &shader, (&samples, &point.gains)))
    }

    /// An engine over the samples that does every lookup anew, as a renderer does; its targets are black.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn live_engine(&self) -> Result<CpuEngine, StudyError> {
        let observed = |samples: &ViewSamples| ObservedView {
            target: Rows::new(3, samples.groups()),
            samples: samples.clone(),
            ..ObservedView::default()
        };
        let views = self.samples.iter().map(observed).collect();
        let illumination = Arc::clone(&self.illumination);
        let task = Task { setup: self.setup(), illumination, views, loss: Loss::L2, unknowns: Vec::new() };
        Ok(CpuEngine::with_kept_terms(task, false)?)
    }
}
