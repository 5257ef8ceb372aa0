//! A scene with its visible surface.

use std::ops::Deref;
use std::path::Path;

use super::{Baked, Observed, PrepareError, PrepareOptions};
use crate::samples::ViewSamples;

/// A scene that was baked, and what its views see of it.
#[derive(Clone, Debug)]
pub struct Sampled {
    /// The scene and its bakes.
    pub baked: Baked,
    /// The visible surface, a view each.
    pub samples: Vec<ViewSamples>,
}

impl Sampled {
    /// Read, bake and sample the scene at `path`.
    ///
    /// # Errors
    /// The first stage's that refuses its input.
    pub fn new(path: &Path, options: &PrepareOptions) -> Result<Self, PrepareError> {
        Baked::new(path, options)?.sample()
    }

    /// The views that have a target, beside it; the others are dropped from the scene, with a warning each.
    ///
    /// # Errors
    /// When no view has a target, or no pixel of a target counts.
    pub fn observe(self) -> Result<Observed, PrepareError> {
        self.baked.observe(self.samples)
    }
}

impl Deref for Sampled {
    type Target = Baked;

    fn deref(&self) -> &Baked {
        &self.baked
    }
}
