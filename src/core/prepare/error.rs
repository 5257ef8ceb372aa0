//! What a stage refuses.

use super::marked::HoldOutError;
use crate::bake::BakeError;
use crate::engine::joint::JointError;
use crate::fit::params_file::ParamsFileError;
use crate::program::shading::ShadingError;
use crate::samples::SampleError;
use crate::scene::error::SceneError;

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
    /// Scenes that cannot be fitted as one skin.
    #[error(transparent)]
    NotOneSkin(#[from] Box<NotOneSkin>),
    /// One scene under two names.
    #[error(
        "{scene}: this scene is named twice: its images would count as twice as many as there are. Name it once."
    )]
    NamedTwice { scene: String },
    /// Scenes of one name.
    #[error(
        "{scenes}: two of these scenes are called the same by their files and folders. Rename one of them."
    )]
    CalledTheSame { scenes: String },
    /// What cannot be left out of a fit.
    #[error(transparent)]
    HoldOut(#[from] HoldOutError),
    /// Scenes that leave other unknowns of the skin free.
    #[error(transparent)]
    Joint(#[from] JointError),
    /// A fit of no scene.
    #[error("there is no scene to fit. Name one.")]
    NoScene,
    /// A fit without anything to match.
    #[error(
        "{scene}: no view names a target, so there is nothing to fit. Add target = \"image.exr\" to a [[view]]."
    )]
    NoTarget { scene: String },
}

/// Scenes that cannot be fitted as one skin.
#[derive(Debug, thiserror::Error)]
#[error(
    "{scene}: it cannot be fitted as one skin with {first}: its {what} differs ({here}; there {there}). {remedy}."
)]
pub struct NotOneSkin {
    /// The scene that differs.
    pub scene: String,
    /// The first scene.
    pub first: String,
    /// What differs.
    pub what: String,
    /// What it is in the scene.
    pub here: String,
    /// What it is in the first one.
    pub there: String,
    /// What to do.
    pub remedy: &'static str,
}
