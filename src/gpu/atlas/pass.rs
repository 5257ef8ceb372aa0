//! One pass over the atlas on the device.

use wgpu::{
    BindGroup, BindingResource, BindingType, CommandEncoder, ComputePass, ComputePipeline, ShaderStages,
    StorageTextureAccess, TextureView, TextureViewDimension,
};

use super::FORMAT;
use super::list::{List, Texels};
use crate::compute::{VertexStage, bind, groups, layout, module, pipeline, storage};
use crate::pipeline::{Inputs, Stages};
use crate::shader::atlas::{Pass, PassKind};
use crate::shader::vertex_stage::Clip;
use crate::upload::{Bound, Uploads};
use crate::{Gpu, GpuError};

/// A pass, and what it reads and leaves.
pub(super) struct AtlasPass {
    pub(super) inputs: Inputs,
    /// What a draw takes of vertices.
    vertices: Option<VertexStage>,
    texels: ComputePipeline,
    /// The list of texels and what is left.
    bound: BindGroup,
    workgroups: u32,
    /// Bytes that it reads of levels and lists, and writes, each once.
    pub(super) bytes: u64,
}

impl AtlasPass {
    /// A pass that reads and leaves these levels.
    ///
    /// # Errors
    /// When the device does not take it.
    pub(super) fn new(
        gpu: &Gpu,
        pass: &Pass,
        uploads: &mut Uploads,
        read: Vec<Bound>,
        (texels, left): (&Texels, &[TextureView]),
    ) -> Result<Self, GpuError> {
        let inputs = Inputs::new(gpu, pass.plan.clone(), uploads, read, Stages::Compute)?;
        let module = module(gpu, "atlas", &pass.plan.wgsl);
        let stride = pass.plan.stride(Clip::Left);
        let vertices =
            (pass.kind == PassKind::Draw).then(|| VertexStage::new(gpu, &inputs, &module, stride, uploads));
        let List { buffer, workgroups } = match pass.kind {
            PassKind::Blur(axis) => texels.tiles(axis),
            PassKind::Dilate => &texels.filled,
            PassKind::Draw | PassKind::Neighbours | PassKind::Surface => &texels.covered,
        };
        let texel = u64::from(FORMAT.block_copy_size(None).unwrap_or_default());
        let levels = (pass.plan.levels.len() + left.len()) as u64;
        let bytes = buffer.size() + levels * texel * texels.count;
        let (mut kinds, mut resources) = (Vec::new(), Vec::new());
        if let Some(vertices) = &vertices {
            kinds.extend([storage(true), storage(false), storage(true)]);
            let buffers = [&vertices.packed, &vertices.varyings, uploads.indices()];
            resources.extend(buffers.map(|buffer| buffer.as_entire_binding()));
        }
        kinds.push(storage(true));
        resources.push(buffer.as_entire_binding());
        kinds.extend(left.iter().map(|_| LEFT));
        resources.extend(left.iter().map(BindingResource::TextureView));
        let kinds: Vec<_> = kinds.into_iter().map(|kind| (ShaderStages::COMPUTE, kind)).collect();
        let own = layout(gpu, "texels", &kinds);
        let bound = bind(gpu, &own, resources);
        let made = pipeline(gpu, "cs_texels", &module, &[&inputs.layout, &own]);
        gpu.check()?;
        Ok(Self { inputs, vertices, texels: made, bound, workgroups: *workgroups, bytes })
    }

    /// Take the vertices as they are.
    pub(super) fn pack(&self, encoder: &mut CommandEncoder) {
        if let Some(vertices) = &self.vertices {
            vertices.pack(encoder, &self.inputs);
        }
    }

    /// Leave the levels.
    pub(super) fn run(&self, pass: &mut ComputePass<'_>) {
        if self.workgroups == 0 {
            return;
        }
        if let Some(vertices) = &self.vertices {
            vertices.run(pass, &self.inputs);
        }
        pass.set_pipeline(&self.texels);
        pass.set_bind_group(0, &self.inputs.bound, &[]);
        pass.set_bind_group(1, &self.bound, &[]);
        let [across, down] = groups(self.workgroups);
        pass.dispatch_workgroups(across, down, 1);
    }
}

/// A level that is left.
const LEFT: BindingType = BindingType::StorageTexture {
    access: StorageTextureAccess::WriteOnly,
    format: FORMAT,
    view_dimension: TextureViewDimension::D2,
};
