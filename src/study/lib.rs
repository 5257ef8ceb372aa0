//! Studies: what is measured about the model and the fits.
//!
//! - [`ablation`]: what each effect and term is worth, and what it costs
//! - [`tradeoff`]: error against time for every approximation
//! - [`suggest`]: which effects a scene calls for
//! - [`stability`]: hard cases on every evaluator, and a random search for new ones
//! - [`sweep`]: many jobs over scenes and settings, on this machine or under a scheduler
//! - [`subject`]: a scene ready to be evaluated in one setting; [`mod@reference`]: what images are compared with
//! - [`significance`]: a change of the loss against its sampling error
//! - [`timing`]: times that can be trusted; [`cost`]: the counts that stand beside them
//! - [`leftovers`]: the files of an earlier run in a study's folder; [`titles`]: what its page is called

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{
    bake, engine, fit, model, output, prepare, program, progress, render, samples, scene, shader, simd,
};
use skinfit_gpu as gpu;
use skinfit_report as report;

pub mod ablation;
pub mod cost;
mod error;
pub mod leftovers;
pub mod reference;
pub mod significance;
pub mod stability;
pub mod subject;
pub mod suggest;
pub mod sweep;
pub mod timing;
pub mod titles;
pub mod tradeoff;

pub use error::StudyError;
