//! Fits of whole maps: every texel of the skin maps, every vertex's occlusion, every texel of the cubes.
//!
//! The image is linear in each map while the others are held, so that a map is the answer of a large, sparse,
//! bounded least-squares problem: conjugate gradients solve it, whose products are forward and backward passes of
//! the shading operation ([`Shade`](crate::Shade)). The maps are taken one after the other, and the constants are solved
//! again after each round. burn's Adam stands beside it, for comparison.
//!
//! - [`layer`]: a map as an unknown: texels, how samples see them, priors
//! - [`problem`]: the loss of the images and the priors, and its slope by a layer's texels
//! - [`cg`]: projected conjugate gradients; [`adam`]: burn's Adam
//! - [`layers`]: the maps that a fit begins with, and what they show; [`parts`]: samples in parts that fit a buffer
//! - [`task`]: what is to be fitted, and how; [`fit`]: the rounds over maps and constants
//! - [`pictures`]: maps as images
//! - [`function`]: images and their loss as functions of constants and maps, with gradients, for solvers elsewhere;
//!   `evaluate`: a point of them on the device; `pixels`: what they are evaluated over

pub mod adam;
pub mod cg;
mod evaluate;
pub mod fit;
pub mod function;
pub mod layer;
pub mod layers;
pub mod parts;
pub mod pictures;
mod pixels;
pub mod problem;
pub mod task;

pub use fit::{FittedMaps, fit_maps};
pub use function::{MapFunction, MapGradients, MapInfo};
pub use layer::{Grid, Layer};
pub use task::MapTask;

use crate::TensorError;
use crate::fit::FitError;
use crate::gpu::GpuError;
use crate::program::shading::ShadingError;

/// A fit of maps that cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The device does not take it.
    #[error(transparent)]
    Tensor(TensorError),
    /// A map, or what is looked up for it, is beyond what one buffer of the device holds.
    #[error(
        "adapter {adapter}: the buffer of the {what} takes {bytes} bytes, but one may have {limit} at most there. Scale the maps down, lower samples_per_axis in [quality] or light_map_size in [diffusion], or choose an adapter with larger buffers."
    )]
    TooLarge {
        /// The adapter.
        adapter: String,
        /// What the buffer holds.
        what: String,
        /// Its bytes.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// The device has no room for all samples and maps.
    #[error(
        "adapter {adapter}: out of memory. A fit of maps keeps all samples on the adapter: lower samples_per_axis in [quality], give fewer or smaller views and maps, or choose another adapter."
    )]
    OutOfMemory {
        /// The adapter.
        adapter: String,
    },
    /// The constants cannot be fitted.
    #[error(transparent)]
    Constants(#[from] FitError),
    /// The rules cannot be computed on the processor.
    #[error(transparent)]
    Shading(#[from] ShadingError),
    /// A free constant that acts through a cube which is fitted itself.
    #[error(
        "{param} cannot be fitted beside the environment: it acts through a cube whose texels are fitted themselves. Hold it, or \
         leave the environment out."
    )]
    Sharpness {
        /// The parameter's name.
        param: &'static str,
    },
    /// Light that reaches the image by more than the fitted cubes.
    #[error(
        "{map} cannot be fitted beside the effect {effect}, which sees the environment by other bakes than its cubes. Leave one of them out."
    )]
    Beside {
        /// The map's name.
        map: &'static str,
        /// The effect.
        effect: &'static str,
    },
    /// Light that texels of the UV atlas see by the fitted cubes.
    #[error(
        "{map} cannot be fitted beside the effect {effect}: the texels that its light stands in hold the environment that they \
         begin with. Leave one of them out."
    )]
    InTexels {
        /// The map's name.
        map: &'static str,
        /// The effect.
        effect: &'static str,
    },
    /// A texture that samples see by other weights than those that the fit moves it by.
    #[error(
        "{map} cannot be fitted with texture_filter = \"{filter}\": a fit reads textures between the four nearest texels. Set \
         texture_filter = \"bilinear\" in [quality]."
    )]
    Filtered {
        /// The map's name.
        map: &'static str,
        /// The filter's name.
        filter: &'static str,
    },
    /// A texture whose texels stand in several places of another.
    #[error(
        "{map} cannot be fitted: the mesh's material mirrors or clamps its pictures where the skin's texture coordinates come to \
         their borders, for which the maps are laid out anew, some texels more than once. Keep the texture coordinates half a \
         texel within the pictures, or name maps in [maps], which repeat."
    )]
    LaidOut {
        /// The map's name.
        map: &'static str,
    },
    /// A map that no enabled effect reads.
    #[error("no enabled effect reads {map}: it cannot be fitted. Leave it out, or enable {effects}.")]
    Unread {
        /// The map's name.
        map: &'static str,
        /// Effects that read it.
        effects: &'static str,
    },
    /// A texture of a mesh on which no texel has a place.
    #[error(
        "the mesh has no texture coordinates (or only one), so no texel of {map} has a place on it. Unwrap the mesh, or leave {map} out."
    )]
    NotUnwrapped {
        /// The map's name.
        map: &'static str,
    },
    /// A list of numbers is of another length.
    #[error("{what}: {found} numbers, where {wanted} are asked for. Give one for each.")]
    Length {
        /// What the numbers are.
        what: &'static str,
        /// How many were given.
        found: usize,
        /// How many there are.
        wanted: usize,
    },
    /// There is no such view.
    #[error("there is no view {view}: there are {views}, counted from 0. Give one of them.")]
    NoView {
        /// Its number.
        view: usize,
        /// How many there are.
        views: usize,
    },
    /// The loss became no number.
    #[error("the loss is not finite after a step of {map}: its values or its priors are too large.")]
    NotFinite {
        /// The map's name.
        map: &'static str,
    },
}

impl MapError {
    /// That a list has that length.
    fn check_length(what: &'static str, found: usize, wanted: usize) -> Result<(), Self> {
        if found == wanted { Ok(()) } else { Err(Self::Length { what, found, wanted }) }
    }
}

impl From<TensorError> for MapError {
    fn from(error: TensorError) -> Self {
        match error {
            TensorError::Gpu(GpuError::BufferSize { adapter, what, bytes, limit, .. }) => {
                Self::TooLarge { adapter, what, bytes, limit }
            }
            TensorError::Gpu(GpuError::OutOfMemory { adapter }) => Self::OutOfMemory { adapter },
            other => Self::Tensor(other),
        }
    }
}
