//! Scenes in one setting, ready to be evaluated: baked, sampled, and with something to compare with.

use std::path::Path;

use super::StudyError;
use super::reference::Source;
use crate::engine::cpu::CpuEngine;
use crate::engine::joint::Joint;
use crate::engine::{Engine, Objective, Point, Task};
use crate::fit::outcome::Outcome;
use crate::fit::{self, FitOptions};
use crate::model::effects::Effect;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param, Params};
use crate::prepare::{
    Baked, HeldOut, JointScenes, Loaded, PrepareError, PrepareOptions, ReadyScene, Sampled,
};
use crate::render::bloom::add_bloom;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::ViewSamples;
use crate::scene::Scene;
use crate::scene::names::names_of;
use crate::scene::view::{Target, View};

/// One scene in one setting, or several of one skin.
pub struct Subject {
    /// The scenes, and the CPU engine over those of their views that have something to be compared with.
    pub scenes: JointScenes,
    /// What they are compared with.
    pub source: Source,
}

/// A scene of a subject, sampled.
#[derive(Debug)]
pub struct SampledScene {
    /// What it is called among several.
    pub name: String,
    /// The scene without what is held out; no samples where that is all.
    pub sampled: Sampled,
    /// What is held out.
    pub held: HeldOut,
}

impl SampledScene {
    /// Bake a scene and sample it; the marked views are held out.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn new(name: String, loaded: Loaded, marked: &[bool]) -> Result<Self, PrepareError> {
        let (baked, held) = loaded.bake()?.hold_out(marked)?;
        let sampled = match held.is_all_of(&baked.scene) {
            true => Sampled { baked, samples: Vec::new() },
            false => baked.sample()?,
        };
        Ok(Self { name, sampled, held })
    }

    /// Whether there is nothing to compare it with.
    fn is_bare(&self) -> bool {
        self.held.views.is_empty() && self.sampled.scene.views.iter().all(|view| view.target.is_none())
    }
}

impl Subject {
    /// Prepare a scene. `change` is called once it is loaded: to hold parameters.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn new(
        scene: &Path,
        options: &PrepareOptions,
        change: impl FnOnce(&mut Loaded),
    ) -> Result<Self, StudyError> {
        let mut loaded = Loaded::read(scene, options)?;
        change(&mut loaded);
        let [name, ..] = names_of(scene);
        Self::of(vec![SampledScene::new(name, loaded, &[])?], None)
    }

    /// These scenes. Their views are compared with `references`, one scene's after the other's, where they are given, and
    /// else with their targets; where no scene has any, with what the model itself makes of them.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn of(scenes: Vec<SampledScene>, references: Option<&[Image]>) -> Result<Self, StudyError> {
        let mut own: Vec<Image> = Vec::new();
        let made = match references {
            Some(images) => Some(images),
            None if scenes.iter().all(SampledScene::is_bare) => {
                for Sampled { baked, samples } in scenes.iter().map(|scene| &scene.sampled) {
                    let samples: Vec<&ViewSamples> = samples.iter().collect();
                    own.extend(images(baked, &baked.scene.views, &samples, &baked.start())?);
                }
                Some(own.as_slice())
            }
            None => None,
        };
        let source = if made.is_some() { Source::Model } else { Source::Targets };
        let mut made = made.map(|images| images.iter());
        let mut ready = Vec::new();
        for SampledScene { name, sampled: Sampled { baked, samples }, held } in scenes {
            if held.is_all_of(&baked.scene) {
                ready.push(ReadyScene { name, baked, held, engine: None });
                continue;
            }
            let baked = match &mut made {
                Some(images) => compared_with(baked, images),
                None => baked,
            };
            let observed = baked.observe(samples)?;
            let engine: Box<dyn Engine> = Box::new(observed.engine()?);
            ready.push(ReadyScene { name, baked: observed.baked, held, engine: Some(engine) });
        }
        Ok(Self { scenes: JointScenes::new(ready)?, source })
    }

    /// The image of each view that is fitted at `point`, one scene's after the other's, bloom and all: the model in f64.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn images(&self, point: &Point) -> Result<Vec<Image>, StudyError> {
        let mut all = Vec::new();
        for part in self.scenes.fitted() {
            let views = self.scenes.views(part);
            let samples: Vec<&ViewSamples> = views.iter().map(|view| &view.samples).collect();
            let own = self.scenes.point_of(part, point);
            all.extend(images(&part.baked, &part.baked.scene.views, &samples, &own)?);
        }
        Ok(all)
    }

    /// The same of the views that are held out.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn held_out_images(&self, point: &Point) -> Result<Vec<Image>, StudyError> {
        let mut all = Vec::new();
        for part in self.scenes.parts.iter().filter(|part| !part.held.views.is_empty()) {
            let HeldOut { views, gains, observed } = &part.held;
            let samples: Vec<&ViewSamples> = observed.iter().map(|view| &view.samples).collect();
            let own = Point { gains: gains.clone(), ..self.scenes.point_of(part, point) };
            all.extend(images(&part.baked, views, &samples, &own)?);
        }
        Ok(all)
    }

    /// Fit what is free, from the scenes' start.
    ///
    /// # Errors
    /// When the fit cannot be done; one that does not converge says so in its outcome.
    pub fn fit(&self, options: &FitOptions) -> Result<Outcome, StudyError> {
        self.fit_from(&self.scenes.start, options)
    }

    /// Fit what is free, from `start`.
    ///
    /// # Errors
    /// When the fit cannot be done; one that does not converge says so in its outcome.
    pub fn fit_from(&self, start: &Point, options: &FitOptions) -> Result<Outcome, StudyError> {
        let options = FitOptions {
            bounds: self.scenes.bounds(),
            effects: Some(self.scenes.effects()),
            ..options.clone()
        };
        fit::fit(&self.scenes.joint, start, &options, &mut |_| {})
            .map_err(|error| StudyError::Fit { scene: self.scenes.files(), error })
    }

    /// What is minimised, anew: nothing is kept of earlier passes.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn objective_anew(&self) -> Result<Joint, StudyError> {
        let mut engines: Vec<Box<dyn Engine>> = Vec::new();
        for task in self.scenes.fitted().filter_map(|part| self.scenes.task(part)) {
            engines.push(Box::new(CpuEngine::new(task)?));
        }
        Ok(Joint::new(engines).map_err(PrepareError::from)?)
    }

    /// A pass over the same samples that keeps nothing from one to the next. For timing.
    ///
    /// # Errors
    /// When a rule cannot be computed on the processor.
    pub fn live_pass(&self, point: &Point) -> Result<LivePass, StudyError> {
        let mut engines = Vec::new();
        for part in self.scenes.fitted() {
            let Some(task) = self.scenes.task(part) else { continue };
            let engine = CpuEngine::with_kept_terms(Task { unknowns: Vec::new(), ..task }, false)?;
            engines.push((engine, self.scenes.point_of(part, point)));
        }
        Ok(LivePass(engines))
    }
}

/// A pass over all samples at a point in which every lookup is done anew, as in a renderer.
#[derive(Debug)]
pub struct LivePass(Vec<(CpuEngine, Point)>);

impl LivePass {
    /// Make it; the losses' sum.
    #[must_use]
    pub fn run(&self) -> f64 {
        self.0.iter().map(|(engine, point)| engine.loss(point)).sum()
    }
}

/// The scene with these images as its views' targets.
fn compared_with<'a>(baked: Baked, images: &mut impl Iterator<Item = &'a Image>) -> Baked {
    baked.with_scene(|scene| {
        for (view, image) in scene.views.iter_mut().zip(images) {
            let (rgb, alpha) = (image.rgb.clone(), Some(image.alpha.clone()));
            view.target = Some(Target { rgb, alpha, haze: None, mask: None, clipped_at: None });
        }
    })
}

fn images(
    baked: &Baked,
    views: &[View],
    samples: &[&ViewSamples],
    point: &Point,
) -> Result<Vec<Image>, StudyError> {
    let shader = Shader::new(baked.setup(), &baked.illumination, &point.params)?;
    Ok(shaded(&baked.scene, views, &shader, (samples, &point.gains)))
}

/// The image of each of these `views` of a scene from its samples, bloom and all, times its gain.
#[must_use]
pub fn shaded(
    scene: &Scene,
    views: &[View],
    shader: &Shader,
    (samples, gains): (&[&ViewSamples], &[Gain]),
) -> Vec<Image> {
    let views = views.iter().zip(samples).enumerate();
    let image = |(i, (view, samples)): (usize, (&View, &&ViewSamples))| {
        let mut shaded = shader.shade(samples, &view.camera, gains.get(i).copied().unwrap_or_default());
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
