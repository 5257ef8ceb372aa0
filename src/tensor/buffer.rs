//! Tensors as ranges of wgpu buffers, and new ones for our passes to write: no number is copied.
//!
//! Burn keeps many tensors in one buffer, so a range is always bound with its offset and size. wgpu lets a
//! dispatch either read or write a buffer, and tells buffers apart, not ranges: a pass therefore declares every
//! tensor `var<storage, read_write>`, even one that it only reads.

use burn::backend::ops::FloatTensorOps as _;
use burn::backend::tensor::FloatTensor;
use burn::backend::wgpu::{AutoCompiler, CubeBackend, CubeTensor, WgpuResource};
use burn::backend::{Autodiff, DType, FloatDType, Shape, TensorMetadata as _};
use burn::tensor::Tensor;
use burn_cubecl::cubecl::wgpu::WgpuServer;
use burn_cubecl::kernel::into_contiguous;
use wgpu::{BindingResource, Buffer};

use super::TensorError;
use crate::gpu::{Gpu, GpuError};

/// A tensor's numbers (32-bit floats, row by row) as a range of a buffer on the shared device.
#[derive(Clone, Debug)]
pub struct TensorBuffer {
    resource: WgpuResource,
    /// The range is the tensor's for as long as there is one.
    tensor: CubeTensor,
}

impl TensorBuffer {
    /// Of a contiguous tensor; what is queued in burn for it is not yet submitted ([`lend`] sees to that).
    fn of(gpu: &Gpu, what: &'static str, tensor: CubeTensor) -> Result<Self, TensorError> {
        let foreign = |reason: String| TensorError::Foreign { what, reason };
        if tensor.dtype != DType::F32 {
            return Err(foreign(format!("its numbers are {:?}", tensor.dtype)));
        }
        let resource = tensor
            .client
            .get_resource::<WgpuServer<AutoCompiler>>(tensor.handle.clone())
            .map_err(|error| foreign(error.to_string()))?;
        let resource = resource.resource().clone();
        // A view into another tensor may begin anywhere.
        if resource.offset % u64::from(gpu.device.limits().min_storage_buffer_offset_alignment) != 0 {
            return Self::of(gpu, what, CubeBackend::float_mul_scalar(tensor, 1.0.into()));
        }
        Ok(Self { resource, tensor })
    }

    /// The buffer; it holds other tensors too.
    #[must_use]
    pub fn buffer(&self) -> &Buffer {
        &self.resource.buffer
    }

    /// Where in the buffer the tensor starts, and how many bytes it takes.
    #[must_use]
    pub fn range(&self) -> (u64, u64) {
        (self.resource.offset, self.resource.size)
    }

    /// The range, ready to be bound.
    #[must_use]
    pub fn binding(&self) -> BindingResource<'_> {
        self.resource.as_wgpu_bind_resource()
    }

    /// The tensor again.
    #[must_use]
    pub fn into_tensor(self) -> CubeTensor {
        self.tensor
    }
}

/// The buffers of `inputs` (of which there is at least one), and of new tensors of the shapes `outputs`. All that
/// burn has still to do for them is on the queue when this returns: what is submitted next sees it done.
///
/// # Errors
/// When an input is not one of 32-bit floats on the device of `gpu`.
pub fn lend(
    gpu: &Gpu,
    inputs: Vec<(&'static str, CubeTensor)>,
    outputs: &[Shape],
) -> Result<(Vec<TensorBuffer>, Vec<TensorBuffer>), TensorError> {
    let Some((client, device)) = inputs.first().map(|(_, t)| (t.client.clone(), t.device.clone())) else {
        return Ok((Vec::new(), Vec::new()));
    };
    let room = |shape: &Shape| CubeBackend::float_empty(shape.clone(), &device, FloatDType::F32);
    // Its stream is this thread's.
    let here = room(&Shape::new([1])).handle.stream;
    let local = |(what, tensor): (&'static str, CubeTensor)| {
        let tensor = into_contiguous(tensor);
        // What another thread has queued is waited for by burn's own operations.
        let near = tensor.handle.stream == here;
        (what, if near { tensor } else { CubeBackend::float_mul_scalar(tensor, 1.0.into()) })
    };
    let buffer = |(what, tensor)| TensorBuffer::of(gpu, what, tensor);
    let lent = inputs.into_iter().map(local).map(buffer).collect::<Result<Vec<_>, _>>()?;
    let made =
        outputs.iter().map(|shape| buffer(("the result", room(shape)))).collect::<Result<Vec<_>, _>>()?;
    client.flush().map_err(|error| {
        TensorError::Gpu(GpuError::Refused { adapter: gpu.name().to_owned(), reason: error.to_string() })
    })?;
    Ok((lent, made))
}

/// The buffer of a tensor that is not tracked.
///
/// # Errors
/// When it is not one of 32-bit floats on the device of `gpu`.
pub fn buffer_of<const D: usize>(gpu: &Gpu, tensor: Tensor<D>) -> Result<TensorBuffer, TensorError> {
    let (mut lent, _) = lend(gpu, vec![("the tensor", plain("the tensor", tensor)?)], &[])?;
    Ok(lent.remove(0))
}

/// A tensor's primitive, cut from its graph.
pub(super) fn plain<const D: usize>(
    what: &'static str,
    tensor: Tensor<D>,
) -> Result<CubeTensor, TensorError> {
    let primitive = tensor.without_autodiff().try_into_primitive::<CubeBackend>();
    primitive.map_err(|error| TensorError::Foreign { what, reason: format!("{error:?}") })
}

/// A tensor's primitive with its place in the graph, on a tracked device or not.
pub(super) fn tracked<const D: usize>(
    what: &'static str,
    tensor: Tensor<D>,
) -> Result<FloatTensor<Autodiff<CubeBackend>>, TensorError> {
    let primitive = tensor.autodiff().try_into_primitive::<Autodiff<CubeBackend>>();
    primitive.map_err(|error| TensorError::Foreign { what, reason: format!("{error:?}") })
}

/// That the tensor has this shape.
pub(super) fn check_shape(
    what: &'static str,
    tensor: &CubeTensor,
    wanted: &[usize],
) -> Result<(), TensorError> {
    let found: Vec<usize> = tensor.shape().iter().copied().collect();
    if found == wanted { Ok(()) } else { Err(TensorError::Shape { what, found, wanted: wanted.to_vec() }) }
}
