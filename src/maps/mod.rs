//! Fits of whole maps: every texel of the skin maps, every vertex's occlusion, every texel of the cubes.
//!
//! The image is linear in each map while the others are held, so that a map is the answer of a large, sparse,
//! bounded least-squares problem: conjugate gradients solve it, whose products are forward and backward passes of
//! the shading operation ([`crate::tensor`]). The maps are taken one after the other, and the constants are solved
//! again after each round. burn's Adam stands beside it, for comparison.
//!
//! - [`layer`]: a map as an unknown: texels, how samples see them, priors
//! - [`problem`]: the loss of the images and the priors, and its slope by a layer's texels
//! - [`cg`]: projected conjugate gradients; [`adam`]: burn's Adam
//! - [`fit`]: the rounds over maps and constants
//! - [`pictures`]: maps as images

pub mod adam;
pub mod cg;
pub mod fit;
pub mod layer;
pub mod pictures;
pub mod problem;

pub use fit::{FittedMaps, MapTask, fit_maps};
pub use layer::{Grid, Layer};

use crate::fit::FitError;
use crate::tensor::TensorError;

/// A fit of maps that cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The device does not take it.
    #[error(transparent)]
    Tensor(#[from] TensorError),
    /// The constants cannot be fitted.
    #[error(transparent)]
    Constants(#[from] FitError),
    /// A map that no enabled effect reads.
    #[error(
        "no enabled effect reads {map}: it cannot be fitted. Leave it out of --maps, or enable {effects}."
    )]
    Unread {
        /// The map's name.
        map: &'static str,
        /// Effects that read it.
        effects: &'static str,
    },
    /// The loss became no number.
    #[error("the loss is not finite after a step of {map}: its values or its priors are too large.")]
    NotFinite {
        /// The map's name.
        map: &'static str,
    },
}
