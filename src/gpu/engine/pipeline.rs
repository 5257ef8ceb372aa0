//! Pipelines, layouts and bindings of compute shaders.

use std::sync::{Mutex, PoisonError};

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, BufferDescriptor, BufferUsages,
    CommandEncoder, CommandEncoderDescriptor, ComputePipeline, ComputePipelineDescriptor,
    PipelineCompilationOptions, PipelineLayoutDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
};

use super::part::PartBuffers;
use crate::Gpu;

/// A uniform block, which is only written when it changes: each write is a copy and a wait on the device.
pub(super) struct Uniform {
    buffer: Buffer,
    written: Mutex<Vec<u8>>,
}

impl Uniform {
    pub(super) fn new(gpu: &Gpu, label: &str, bytes: usize) -> Self {
        let buffer = buffer(gpu, label, bytes, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        Self { buffer, written: Mutex::default() }
    }

    pub(super) const fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    pub(super) fn write(&self, gpu: &Gpu, bytes: &[u8]) {
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        if *written != bytes {
            gpu.queue.write_buffer(&self.buffer, 0, bytes);
            *written = bytes.to_vec();
        }
    }
}

/// A buffer of `bytes` bytes; of 16 at the least, as bindings may not be empty.
pub(super) fn buffer(gpu: &Gpu, label: &str, bytes: usize, usage: BufferUsages) -> Buffer {
    gpu.device.create_buffer(&BufferDescriptor {
        label: Some(label),
        size: (bytes as u64).max(16),
        usage,
        mapped_at_creation: false,
    })
}

pub(super) fn encoder(gpu: &Gpu) -> CommandEncoder {
    gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("fused pass") })
}

pub(super) fn pipeline(gpu: &Gpu, label: &str, wgsl: &str, layouts: &[&BindGroupLayout]) -> ComputePipeline {
    let module = gpu.device.create_shader_module(ShaderModuleDescriptor {
        label: Some(label),
        source: ShaderSource::Wgsl(wgsl.into()),
    });
    let layouts: Vec<Option<&BindGroupLayout>> = layouts.iter().copied().map(Some).collect();
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("cs_main"),
        compilation_options: PipelineCompilationOptions::default(),
        cache: None,
    })
}

pub(super) fn bind(gpu: &Gpu, layout: &BindGroupLayout, buffers: &[&Buffer]) -> BindGroup {
    let entries: Vec<BindGroupEntry<'_>> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    gpu.device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries })
}

pub(super) fn layout(gpu: &Gpu, label: &str, kinds: &[(u32, BindingType)]) -> BindGroupLayout {
    let entry = |&(binding, ty): &(u32, BindingType)| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let entries: Vec<BindGroupLayoutEntry> = kinds.iter().map(entry).collect();
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

const fn buffer_kind(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub(super) const UNIFORM: BindingType = buffer_kind(BufferBindingType::Uniform);
pub(super) const READ: BindingType = buffer_kind(BufferBindingType::Storage { read_only: true });
pub(super) const WRITE: BindingType = buffer_kind(BufferBindingType::Storage { read_only: false });

/// Group 1 of a shader over a part: counts, samples, group starts, targets, what is written; samples and targets
/// again, to be read four numbers at a time; with `levels`, what samples look up of the UV atlas.
pub(super) fn part_layout(gpu: &Gpu, levels: bool) -> BindGroupLayout {
    let kinds = [(0, UNIFORM), (1, READ), (2, READ), (3, READ), (4, WRITE), (5, READ), (6, READ), (7, READ)];
    layout(gpu, "part", &kinds[..if levels { 8 } else { 7 }])
}

/// What [`part_layout`] asks for.
pub(super) fn bind_part(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    counts: &Uniform,
    PartBuffers { samples, group_start, targets, levels }: &PartBuffers,
    written: &Buffer,
) -> BindGroup {
    let mut buffers = vec![counts.buffer(), samples, group_start, targets, written, samples, targets];
    buffers.extend(levels);
    bind(gpu, layout, &buffers)
}
