//! The program around the library: its command line, progress bars and signals.

pub mod cli;
mod progress;

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{
    bake, demo, engine, export, files, fit, model, output, prepare, render, samples, scene, shader, simd,
};
use skinfit_gpu as gpu;
use skinfit_report as report;
use skinfit_study as study;
#[cfg(feature = "burn")]
use skinfit_tensor::{self as tensor, maps};
