//! skinfit's library: from a scene to fitted constants, images and shaders, on the CPU.
//!
//! Data flows one way through the modules, as `docs/architecture.md` draws it:
//!
//! - [`model`]: what the rules of *Skin in the "Dawn" Demo* (GPU Gems, chapter 3) are about: the parameter table,
//!   effects, terms, cubes, kinds of numbers. Knows nothing of files or meshes.
//! - [`scene`]: scene files, meshes, maps, cameras: everything that is read.
//! - [`builtin`]: the scene that the program makes by itself.
//! - [`bake`]: environment to cube maps and spherical harmonics, ambient occlusion and transfer, and their cache.
//! - [`samples`]: the visible surface of each view, as records of sixteen pixels.
//! - [`engine`]: loss, gradient and normal equations over samples.
//! - [`fit`]: the solvers, and what is known of the answer afterwards.
//! - [`render`]: images from samples, and image files.
//! - [`prepare`]: the stages up to the samples, run once and timed.
//! - [`demo`]: the built-in scene as files, its targets rendered.
//! - [`shader`]: the model's formulas as rules in WGSL, and the planner that makes shaders of them.
//! - [`program`]: planned rules as arithmetic on numbers, for the processor.
//! - [`export`]: constants and shaders as text for other engines.
//! - [`specular`]: the specular BRDFs in f64, their integrals, and the rational functions that the rules take for these.
//! - [`files`], [`output`], [`progress`], [`simd`]: files read from disk or memory; written whole or not at all; who is told how far long work is; which
//!   SIMD instructions there are.

pub mod bake;
pub mod builtin;
pub mod demo;
pub mod engine;
pub mod export;
pub mod files;
pub mod fit;
pub mod model;
pub mod output;
pub mod prepare;
pub mod program;
pub mod progress;
pub mod render;
pub mod samples;
pub mod scene;
pub mod shader;
pub mod simd;
pub mod specular;
