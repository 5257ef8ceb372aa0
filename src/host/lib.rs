//! The program around the library: its command line, progress bars and signals.
//!
//! - [`cli`]: a file or folder a command; a program that contains this one runs [`cli::main_of`], and fits by [`cli::CommandLine`]
//! - [`contained`]: what is said then is heard by that program
//! - `progress`: progress bars

pub mod cli;
pub mod contained;
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
