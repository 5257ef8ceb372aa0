//! What passes over the atlas are given: their pipelines and constants, tensors as buffers, counts, and the atlas as texts are
//! written for it.

use wgpu::{BindingType, Buffer, BufferUsages, ComputePipeline};

use crate::buffer::TensorBuffer;
use crate::gpu::{Gpu, GpuError};
use crate::inputs::Input;
use crate::pass::{self, READ, WRITE};
use crate::program::graph;
use crate::samples::Atlas;
use crate::shader::atlas::buffers::StoredTexels;
use crate::shader::emit::Plan;
use crate::stage::resident::Constants;

/// A pass: its pipeline, and the constants that it reads.
#[derive(Debug)]
pub(super) struct Pass {
    pub(super) pipeline: ComputePipeline,
    pub(super) constants: Option<Constants>,
}

impl Pass {
    /// Of a module over the atlas that binds so many buffers beside what all of them do, as they are written to or not.
    pub(super) fn new(
        gpu: &Gpu,
        plan: &Plan,
        (wgsl, beside): (&str, &[BindingType]),
        constants: Option<Constants>,
    ) -> Result<Self, GpuError> {
        let block = constants.as_ref().map(|_| (0, pass::UNIFORM));
        let faces = (1..=plan.resources.len() as u32).map(|binding| (binding, pass::FACES));
        let own = [WRITE, READ, READ, READ].into_iter().chain(beside.iter().copied());
        let groups = [block.into_iter().chain(faces).collect(), (0..).zip(own).collect()];
        let module = pass::module(gpu, "levels", wgsl)?;
        Ok(Self { pipeline: pass::pipeline_of(gpu, &module, "cs_main", &groups)?, constants })
    }
}

/// Tensors as buffers.
pub(super) struct Lent {
    pub(super) inputs: Vec<(Input, TensorBuffer)>,
    pub(super) beside: Vec<TensorBuffer>,
    pub(super) made: Vec<TensorBuffer>,
}

impl Lent {
    pub(super) fn input(&self, input: Input) -> Option<&TensorBuffer> {
        self.inputs.iter().find(|(of, _)| *of == input).map(|(_, lent)| lent)
    }
}

/// A block of counts.
pub(super) fn uniform(gpu: &Gpu, numbers: &[u32]) -> Buffer {
    gpu.buffer("counts", bytemuck::cast_slice(numbers), BufferUsages::UNIFORM)
}

/// The row of texels' records that holds a number.
pub(super) fn row_of(atlas: &Atlas) -> impl Fn(&str, usize) -> Option<usize> + '_ {
    |name, component| atlas.row(&graph::Input { name: name.to_owned(), component })
}

/// The atlas that shaders are written for.
pub(super) fn stored_texels<'a>(
    atlas: &Atlas,
    row: &'a dyn Fn(&str, usize) -> Option<usize>,
) -> StoredTexels<'a> {
    StoredTexels { size: atlas.size(), rows: atlas.rows().stride(), row }
}
