//! What places the parts that are not skin: a planned vertex stage, bound to their corners.

use wgpu::{
    BindGroup, Buffer, BufferUsages, RenderPass, VertexAttribute, VertexBufferLayout, VertexFormat,
    VertexStepMode,
};

use super::corners::Corners;
use crate::constants::{Values, block_bytes};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::formats::vertex_format;
use crate::pipeline::{self, Inputs, Stages};
use crate::shader::Plan;
use crate::upload::Bound;

/// A vertex stage with what it reads.
pub(super) struct Placed {
    pub(super) inputs: Inputs,
    /// Factors on the base colour, a corner each.
    tints: Buffer,
    /// What the plan reads beside attributes, in its order.
    resources: Vec<Bound>,
}

impl Placed {
    /// Those corners, placed by a plan.
    ///
    /// # Errors
    /// When they are more than the adapter takes.
    pub(super) fn new(gpu: &Gpu, plan: Plan, corners: &mut Corners) -> Result<Self, GpuError> {
        let attributes = plan.attributes.iter().map(|&a| corners.attribute(gpu, a));
        let attributes = attributes.collect::<Result<Vec<_>, _>>()?;
        let resources = plan.resources.iter().map(|&r| corners.resource(gpu, r).map(Bound::Buffer));
        let resources = resources.collect::<Result<Vec<_>, _>>()?;
        let inputs = Inputs::of(gpu, plan, attributes, &resources, Stages::Raster);
        Ok(Self { inputs, tints: corners.tints().clone(), resources })
    }

    /// Set the constants of what is drawn next.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>) {
        self.inputs.set(gpu, values);
    }

    /// A uniform block for the plan's constants beside its own, bound with what else it reads.
    pub(super) fn constants(&self, gpu: &Gpu) -> (Buffer, BindGroup) {
        let plan = &self.inputs.plan;
        let block = vec![0; block_bytes(&plan.constants, plan.facts.morphs)];
        let buffer = gpu.buffer("constants", &block, BufferUsages::UNIFORM);
        let bound = pipeline::bind(gpu, &self.inputs.layout, Some(&buffer), &self.resources);
        (buffer, bound)
    }

    /// How each buffer is read, and the bytes of a corner in it.
    pub(super) fn attributes(&self) -> Vec<([VertexAttribute; 1], u64)> {
        let read = self.inputs.plan.attributes.iter().map(|&a| (vertex_format(a), a.bytes()));
        let tint = (VertexFormat::Float32x4, 16);
        let attribute = |(shader_location, (format, bytes))| {
            ([VertexAttribute { format, offset: 0, shader_location }], bytes)
        };
        (0_u32..).zip(read.chain([tint])).map(attribute).collect()
    }

    /// Have a pass read them, in the order of the shader's locations.
    pub(super) fn set_buffers(&self, pass: &mut RenderPass<'_>) {
        for (slot, buffer) in (0_u32..).zip(self.inputs.attributes.iter().chain([&self.tints])) {
            pass.set_vertex_buffer(slot, buffer.slice(..));
        }
    }
}

/// The layouts of such buffers.
pub(super) fn layouts(attributes: &[([VertexAttribute; 1], u64)]) -> Vec<Option<VertexBufferLayout<'_>>> {
    let step_mode = VertexStepMode::Vertex;
    let each = attributes.iter();
    each.map(|(attributes, bytes)| Some(VertexBufferLayout { array_stride: *bytes, step_mode, attributes }))
        .collect()
}
