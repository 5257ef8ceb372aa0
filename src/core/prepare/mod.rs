//! The stages before a fit or a render, each made from the one before by value: what a stage was made of does not
//! change under it.
//!
//! - [`Loaded`]: the scene as it was read; here it may still be changed
//! - [`Baked`]: it and its light and occlusion (`registration`: its cameras moved to where targets show the mesh)
//! - [`Sampled`]: these and the visible surface of each view
//! - [`Observed`]: of the views that have a target, samples beside what was observed there
//!   (`silhouettes`: whether it lies where the mesh is)
//! - [`HeldOut`]: views that are taken out of a scene before its fit, to score it on
//!
//! Of several scenes that are fitted as one skin: [`scene_names`] calls them, [`share_skin`] has them agree on what is one
//! for all, [`read_one_skin`] reads them so, [`NamedScene::marked`] says which of their views are held out, and
//! [`JointScenes`] has them with what is minimised over all.
//!
//! A stage reads as the ones before it: `observed.scene`, `sampled.illumination`. Renderers start from a [`Baked`],
//! engines from an [`Observed`].

mod baked;
mod error;
mod held_out;
mod joint_scenes;
mod loaded;
mod marked;
mod named;
mod observed;
mod one_skin;
mod options;
mod registration;
mod sampled;
mod silhouettes;

pub use self::baked::Baked;
pub use self::error::{NotOneSkin, PrepareError};
pub use self::held_out::HeldOut;
pub use self::joint_scenes::{JointScene, JointScenes, ReadyScene, view_of};
pub use self::loaded::{Loaded, untied};
pub use self::marked::HoldOutError;
pub use self::named::{NamedScene, read_one_skin, read_one_skin_each, scene_names};
pub use self::observed::Observed;
pub use self::one_skin::share_skin;
pub use self::options::{ClipOcclusion, PrepareOptions, Views};
pub use self::registration::MovedCamera;
pub use self::sampled::Sampled;

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
