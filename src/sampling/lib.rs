//! From a scene to samples: what is baked of it, and its visible surface.
//!
//! - [`bake`]: environment to cube maps and spherical harmonics, ambient occlusion and transfer, and their cache.
//! - [`samples`]: the visible surface of each view, as records of sixteen pixels.

#[cfg(test)]
use skinfit_base::simd;
use skinfit_base::{files, output, progress, with_simd};
use skinfit_rules::{model, program, shader, specular};
use skinfit_scene as scene;

pub mod bake;
pub mod samples;
