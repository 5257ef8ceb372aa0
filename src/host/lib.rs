//! The program around the library: its command line.

pub mod cli;

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{
    bake, demo, engine, export, fit, model, output, prepare, progress, render, samples, scene, shader, simd,
};
use skinfit_gpu as gpu;
use skinfit_report as report;
use skinfit_study as study;
#[cfg(feature = "burn")]
use skinfit_tensor::{self as tensor, maps};
