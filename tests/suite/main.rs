//! The tests that go through files, real scenes or the program itself: one binary, so that it is
//! linked once. What concerns one module alone is tested beside it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

mod bakes;
mod builtin;
mod cli;
mod common;
mod damage;
mod documents;
mod engine;
mod exports;
mod fits;
mod fixtures;
#[cfg(feature = "gpu")]
mod graphics;
mod meshes;
mod occlusion;
mod refusals;
mod reports;
mod samples;
mod scene_files;
mod scene_folder;
#[cfg(target_os = "linux")]
mod scheduler;
mod shader;
#[cfg(feature = "burn")]
mod tensors;
mod vectors;
