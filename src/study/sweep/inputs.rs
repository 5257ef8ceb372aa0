//! What a job reads, and why one cannot be done.

use std::path::Path;

use crate::StudyError;
use crate::fit::FitError;
use crate::prepare::PrepareError;
use crate::scene::error::SceneError;

/// A job could not be done.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant is the stage's own error")]
pub enum JobError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Study(#[from] StudyError),
}

/// What a job reads.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Its scene file.
    pub scene: &'a Path,
    /// A fit's constants, where it is given some.
    pub constants: Option<&'a Path>,
    /// Where bakes are kept.
    pub cache: Option<&'a Path>,
    /// Where, without that, they may be kept as long as the job runs: studies ask for them again and again.
    pub scratch: Option<&'a Path>,
}
