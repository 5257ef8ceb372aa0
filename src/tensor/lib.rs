//! The shading model on burn's tensors: operations of burn's autodiff around our own compute passes.
//!
//! - [`device`]: one wgpu device for burn and for us
//! - [`buffer`]: tensors as ranges of wgpu buffers, both ways without a copy
//! - [`shade`]: the model as an operation, of what is [`Shaded`]; [`inputs`]: what it takes; `stage`: its passes;
//!   `scatter`: what lookups of a cube gained, added to its texels
//! - [`levels`]: what is computed in texels of the UV atlas, likewise; `operation`: what burn sees of both
//! - `row_sums`: sums of rows in a fixed tree; `atomic_sums.wgsl`: of what many threads add, exact or fast
//! - `drawn`: samples that the adapter drew, as tensors
//! - [`adjoint`]: the text of those passes: the image of stored samples, and its vector-Jacobian product
//! - [`footprint`]: the linear maps of a scene: texels, vertices, cube borders
//! - [`maps`]: fits of whole maps
//! - [`sparse`]: fixed linear maps, forwards and transposed: how maps are sampled, and how pixels are averaged

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{bake, engine, fit, model, prepare, program, render, samples, scene, shader};
use skinfit_gpu as gpu;

pub mod adjoint;
pub mod buffer;
pub mod device;
mod drawn;
pub mod footprint;
pub mod inputs;
pub mod levels;
pub mod maps;
mod operation;
mod pass;
mod row_sums;
mod scatter;
pub mod shade;
mod shaded;
pub mod sparse;
mod stage;

pub use device::SharedDevice;
pub use inputs::{Input, Inputs};
pub use levels::Levels;
pub use shade::Shade;
pub use shaded::{Scatter, Shaded};
pub use sparse::Sparse;

use burn::backend::ops::FloatTensorOps as _;
use burn::backend::wgpu::{CubeBackend, CubeTensor};
use burn::backend::{FloatDType, Shape};
use burn_cubecl::CubeDevice;

use crate::adjoint::AdjointError;
use crate::model::effects::Effects;
use crate::shader::PlanError;
use gpu::{Gpu, GpuError};

/// A tensor operation that cannot be done.
#[derive(Clone, Debug, thiserror::Error)]
pub enum TensorError {
    /// The device does not take it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Burn does not take the device.
    #[error(
        "adapter {adapter}: burn cannot use it: {reason}. Choose another adapter, or leave tensors and maps out."
    )]
    NotShared {
        /// The adapter.
        adapter: String,
        /// Burn's words.
        reason: String,
    },
    /// A tensor of another device, backend or kind.
    #[error(
        "{what}: the tensor is not one of 32-bit floats on the shared device: {reason}. Make it on SharedDevice::device()."
    )]
    Foreign {
        /// Which tensor.
        what: &'static str,
        /// What it is instead.
        reason: String,
    },
    /// A tensor of another shape.
    #[error("{what}: the tensor has the shape {found:?}, not {wanted:?}")]
    Shape {
        /// Which tensor.
        what: &'static str,
        /// Its shape.
        found: Vec<usize>,
        /// The shape that it must have.
        wanted: Vec<usize>,
    },
    /// No shader yields the image, or its derivatives.
    #[error(transparent)]
    Model(#[from] AdjointError),
    /// What is computed in texels is not what tensors make.
    #[error("tensors have no {what}. {remedy}, or leave tensors and maps out.")]
    Levels {
        /// What it is.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
}

impl TensorError {
    /// That there are no texels for what `effects` compute in them.
    fn no_atlas(effects: Effects) -> Self {
        AdjointError::from(PlanError::no_atlas(effects)).into()
    }
}

/// What a backward pass leaves when it cannot be done: zeros in the place of a gradient of that shape, and the
/// reason for [`Gpu::check`] to tell, as burn's backward passes return nothing.
fn or_zeros(
    gpu: &Gpu,
    result: Result<CubeTensor, TensorError>,
    shape: Shape,
    device: &CubeDevice,
) -> CubeTensor {
    result.unwrap_or_else(|error| {
        gpu.fail(match error {
            TensorError::Gpu(error) => error,
            other => GpuError::Refused { adapter: gpu.name().to_owned(), reason: other.to_string() },
        });
        CubeBackend::float_zeros(shape, device, FloatDType::F32)
    })
}
