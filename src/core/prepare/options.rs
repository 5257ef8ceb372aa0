//! What is asked of the stages.

use std::path::PathBuf;

use super::PrepareError;
use crate::model::effects::Effects;
use crate::scene::view::Background;
use crate::scene::{Assignment, Scene, suggestion};

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
    /// Seconds into the animation, instead of the scene's.
    pub time: Option<f64>,
    /// That the mesh will go through its animation, and how its occlusion follows.
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

impl Views {
    /// Leave these of the scene's views.
    pub(super) fn choose(&self, scene: &mut Scene) -> Result<(), PrepareError> {
        match self {
            Self::All => {}
            Self::First => scene.views.truncate(1),
            Self::Named(name) => {
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
}
