//! Scenes that are fitted as one skin, and what is minimised over all of them.

use std::path::Path;
use std::sync::Arc;

use super::{Baked, HeldOut, PrepareError, StageSeconds};
use crate::engine::joint::{Joint, label};
use crate::engine::view::ObservedView;
use crate::engine::{Engine, Point, Task};
use crate::model::bounds::Bounds;
use crate::model::effects::Effects;
use crate::model::params::{Param, Params};

/// A scene that is ready to be fitted with others.
pub struct ReadyScene {
    /// What it is called among them.
    pub name: String,
    /// The scene with the views that are fitted.
    pub baked: Baked,
    /// The views that are not.
    pub held: HeldOut,
    /// The engine over those that are; none where all views are held out.
    pub engine: Option<Box<dyn Engine>>,
}

/// The scenes of a fit.
pub struct JointScenes {
    /// Every one, in their order.
    pub parts: Vec<JointScene>,
    /// Those that are fitted, as one objective.
    pub joint: Joint,
    /// Where their fit starts: the skin as in the first of them.
    pub start: Point,
}

/// One scene of a fit.
#[derive(Debug)]
pub struct JointScene {
    /// What it is called among several.
    pub name: String,
    /// The scene with the views that are fitted.
    pub baked: Baked,
    /// The views that are not.
    pub held: HeldOut,
    /// Its number among the scenes that are fitted; none where all of its views are held out.
    pub number: Option<usize>,
}

impl JointScene {
    /// Its file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.baked.scene.path
    }
}

impl JointScenes {
    /// These scenes.
    ///
    /// # Errors
    /// When none of them has an engine, or what is free of the skin differs from scene to scene.
    pub fn new(scenes: Vec<ReadyScene>) -> Result<Self, PrepareError> {
        let (mut parts, mut engines, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        for ReadyScene { name, baked, held, engine } in scenes {
            let number = engine.is_some().then_some(engines.len());
            starts.extend(engine.is_some().then(|| baked.start()));
            engines.extend(engine);
            parts.push(JointScene { name, baked, held, number });
        }
        let start = Joint::start(&starts).ok_or(PrepareError::NoScene)?;
        Ok(Self { parts, joint: Joint::new(engines)?, start })
    }

    /// Whether there are several scenes.
    #[must_use]
    pub fn several(&self) -> bool {
        self.parts.len() > 1
    }

    /// The first scene: there is one at the least.
    #[must_use]
    pub fn first(&self) -> &JointScene {
        &self.parts[0]
    }

    /// The scenes that are fitted, in their order.
    pub fn fitted(&self) -> impl Iterator<Item = &JointScene> {
        self.parts.iter().filter(|part| part.number.is_some())
    }

    /// The engine over a scene's views, where it is fitted.
    #[must_use]
    pub fn engine(&self, part: &JointScene) -> Option<&dyn Engine> {
        self.joint.engines().nth(part.number?)
    }

    /// The views that are fitted of a scene.
    #[must_use]
    pub fn views(&self, part: &JointScene) -> &[ObservedView] {
        self.engine(part).map_or(&[], |engine| engine.views())
    }

    /// What the engine over a scene's views evaluates, where it is fitted.
    #[must_use]
    pub fn task(&self, part: &JointScene) -> Option<Task> {
        Some(part.baked.task_over(Arc::clone(self.engine(part)?.views())))
    }

    /// What each fitted scene bounds its free parameters by.
    #[must_use]
    pub fn bounds(&self) -> Vec<Bounds> {
        self.fitted().map(|part| part.baked.scene.fit.bounds.clone()).collect()
    }

    /// The effects of the fitted scenes: what is shared over scenes is asked for by one of them.
    #[must_use]
    pub fn effects(&self) -> Effects {
        self.fitted()
            .fold(Effects::of(&[]), |all, part| part.baked.scene.effects.iter().fold(all, Effects::with))
    }

    /// Pixels in a row of each fitted view's image.
    #[must_use]
    pub fn widths(&self) -> Vec<usize> {
        self.fitted().flat_map(|part| part.baked.image_widths()).collect()
    }

    /// Where a scene stands at the end of a fit; where it had no part in that, the skin is in the scene's own light.
    #[must_use]
    pub fn point_of(&self, part: &JointScene, end: &Point) -> Point {
        let fitted = part.number.and_then(|number| self.joint.point_in(number, end));
        fitted.unwrap_or_else(|| {
            let mut params: Params = part.baked.scene.params.clone();
            let skin = Param::all().filter(|param| !param.is_of_scene());
            skin.for_each(|param| params.set_rgb(param, end.params.rgb(param)));
            Point { params, gains: Vec::new() }
        })
    }

    /// The same of every scene, in their order.
    #[must_use]
    pub fn points(&self, end: &Point) -> Vec<Point> {
        self.parts.iter().map(|part| self.point_of(part, end)).collect()
    }

    /// What a view is called in reports: of several scenes after its scene.
    #[must_use]
    pub fn view_name(&self, part: &JointScene, view: &str) -> String {
        if self.several() { view_of(&part.name, view) } else { view.to_owned() }
    }

    /// What an unknown of that name is called in reports.
    #[must_use]
    pub fn label(&self, name: &str) -> String {
        let scene = |number: usize| self.fitted().nth(number).map(|part| part.name.clone());
        let mut views =
            self.fitted().flat_map(|part| part.baked.scene.views.iter().map(move |view| (part, view)));
        let view = |number: usize| views.nth(number).map(|(part, view)| self.view_name(part, &view.name));
        label(name, scene, view)
    }

    /// The scenes' files, for words about all of them.
    #[must_use]
    pub fn files(&self) -> String {
        self.parts.iter().map(|part| part.path().display().to_string()).collect::<Vec<_>>().join(", ")
    }

    /// The seconds of each stage, of all scenes together; of samples those of the engines that made their own.
    #[must_use]
    pub fn seconds(&self) -> StageSeconds {
        let mut all = StageSeconds::default();
        for part in &self.parts {
            let own = self.engine(part).and_then(Engine::own_sample_seconds);
            let seconds = part.baked.seconds;
            all.load += seconds.load;
            all.bake += seconds.bake;
            all.samples += own.unwrap_or_default() + seconds.samples;
            all.maps += seconds.maps;
        }
        all
    }
}

/// What a view is called among those of several scenes.
#[must_use]
pub fn view_of(scene: &str, view: &str) -> String {
    format!("{scene}/{view}")
}
