//! **skinfit**: a differentiable shading-fit tool for real-time skin.
//!
//! The library is the members of the workspace; its modules stand here under one name:
//!
//! - `skinfit_core`: from a scene to fitted constants, images and shaders, on the CPU
//! - `skinfit_gpu`: the production renderer and the engine on a graphics adapter
//! - `skinfit_tensor`: the model on burn's tensors, and fits of whole maps (feature `burn`)
//! - `skinfit_report`: metrics, pictures and pages that show how good a fit is
//! - `skinfit_study`: what is measured about the model and the fits
//! - `skinfit_host`: the command line

pub use skinfit_core::{
    bake, builtin, demo, export, fit, model, output, prepare, progress, render, samples, scene, shader, simd,
};
pub use skinfit_gpu as gpu;
pub use skinfit_host::cli;
pub use skinfit_report as report;
pub use skinfit_study as study;
#[cfg(feature = "burn")]
pub use skinfit_tensor::{self as tensor, maps};

/// Loss, gradient and normal equations over samples.
pub mod engine {
    pub use skinfit_core::engine::*;
    pub use skinfit_gpu::engine as gpu;
}
