//! Compute shaders: layouts, bindings, pipelines, and a plan's vertex stage as one of them.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, BufferDescriptor,
    BufferUsages, CommandEncoder, ComputePass, ComputePassDescriptor, ComputePipeline,
    ComputePipelineDescriptor, PipelineCompilationOptions, PipelineLayoutDescriptor, ShaderModule,
    ShaderModuleDescriptor, ShaderSource, ShaderStages,
};

use super::device::Gpu;
use super::pipeline::Inputs;
use super::timing::Timer;
use super::upload::Uploads;
use crate::MOST_OF_A_DISPATCH;
use crate::shader::vertex_stage::VERTICES;

/// A plan's vertex stage, run once a vertex: `cs_vertices`.
pub(super) struct VertexStage {
    pipeline: ComputePipeline,
    bound: BindGroup,
    /// Attributes of all vertices, one after another.
    pub(super) packed: Buffer,
    /// What is handed over of each.
    pub(super) varyings: Buffer,
    groups: [u32; 2],
}

impl VertexStage {
    /// Of a module that hands over `stride` numbers a vertex.
    pub(super) fn new(
        gpu: &Gpu,
        inputs: &Inputs,
        module: &ShaderModule,
        stride: usize,
        uploads: &Uploads,
    ) -> Self {
        let buffer = |label, size| {
            gpu.device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let count = uploads.vertex_count();
        let packed = buffer("attributes", inputs.attributes.iter().map(Buffer::size).sum::<u64>().max(4));
        let varyings = buffer("varyings", 4 * count * stride as u64);
        let compute = ShaderStages::COMPUTE;
        let own = layout(gpu, "vertices", &[(compute, storage(true)), (compute, storage(false))]);
        Self {
            pipeline: pipeline(gpu, "cs_vertices", module, &[&inputs.layout, &own]),
            bound: bind(gpu, &own, vec![packed.as_entire_binding(), varyings.as_entire_binding()]),
            packed,
            varyings,
            groups: groups(count.div_ceil(u64::from(VERTICES)) as u32),
        }
    }

    /// Take the attributes as they are: a pose's own may have been written since.
    pub(super) fn pack(&self, encoder: &mut CommandEncoder, inputs: &Inputs) {
        let mut first = 0;
        for attribute in &inputs.attributes {
            encoder.copy_buffer_to_buffer(attribute, 0, &self.packed, first, attribute.size());
            first += attribute.size();
        }
    }

    /// Run it.
    pub(super) fn run(&self, pass: &mut ComputePass<'_>, inputs: &Inputs) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &inputs.bound, &[]);
        pass.set_bind_group(1, &self.bound, &[]);
        pass.dispatch_workgroups(self.groups[0], self.groups[1], 1);
    }
}

/// At least `count` workgroups, across and down.
pub(super) fn groups(count: u32) -> [u32; 2] {
    let across = count.clamp(1, MOST_OF_A_DISPATCH);
    [across, count.div_ceil(across)]
}

pub(super) const fn storage(read_only: bool) -> BindingType {
    let ty = BufferBindingType::Storage { read_only };
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub(super) fn layout(gpu: &Gpu, label: &str, entries: &[(ShaderStages, BindingType)]) -> BindGroupLayout {
    let entry = |(binding, &(visibility, ty))| BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<BindGroupLayoutEntry> = (0..).zip(entries).map(entry).collect();
    let label = Some(label);
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label, entries: &entries })
}

pub(super) fn bind(gpu: &Gpu, layout: &BindGroupLayout, resources: Vec<BindingResource<'_>>) -> BindGroup {
    let entry = |(binding, resource)| BindGroupEntry { binding, resource };
    let entries: Vec<BindGroupEntry<'_>> = (0..).zip(resources).map(entry).collect();
    gpu.device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries })
}

pub(super) fn module(gpu: &Gpu, label: &str, text: &str) -> ShaderModule {
    let source = ShaderSource::Wgsl(text.into());
    gpu.device.create_shader_module(ShaderModuleDescriptor { label: Some(label), source })
}

pub(super) fn compute_pass<'a>(
    encoder: &'a mut CommandEncoder,
    label: &'static str,
    mut timer: Option<&mut Timer>,
) -> ComputePass<'a> {
    let timestamp_writes = timer.as_mut().and_then(|timer| timer.around_compute(label));
    encoder.begin_compute_pass(&ComputePassDescriptor { label: Some(label), timestamp_writes })
}

pub(super) fn pipeline(
    gpu: &Gpu,
    entry: &str,
    module: &ShaderModule,
    groups: &[&BindGroupLayout],
) -> ComputePipeline {
    let groups: Vec<Option<&BindGroupLayout>> = groups.iter().map(|&group| Some(group)).collect();
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: PipelineCompilationOptions::default(),
        cache: None,
    })
}
