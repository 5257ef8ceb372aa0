//! One compute pass of ours on the shared queue.

use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, BufferBindingType, CommandEncoder, ComputePassDescriptor, ComputePipeline,
    ComputePipelineDescriptor, PipelineCompilationOptions, PipelineLayout, PipelineLayoutDescriptor,
    ShaderModule, ShaderModuleDescriptor, ShaderSource, ShaderStages, TextureSampleType,
    TextureViewDimension,
};

use crate::gpu::{Gpu, GpuError, MOST_OF_A_DISPATCH};

/// Threads of a workgroup, in every module here.
pub(super) const WORKGROUP: u32 = 64;

/// A module from text.
pub(super) fn module(gpu: &Gpu, label: &str, wgsl: &str) -> Result<ShaderModule, GpuError> {
    let source = ShaderSource::Wgsl(wgsl.into());
    let module = gpu.device.create_shader_module(ShaderModuleDescriptor { label: Some(label), source });
    gpu.check()?;
    Ok(module)
}

/// An entry point of a module, its layout taken from the text.
pub(super) fn pipeline(gpu: &Gpu, module: &ShaderModule, entry: &str) -> Result<ComputePipeline, GpuError> {
    made(gpu, module, entry, None)
}

fn made(
    gpu: &Gpu,
    module: &ShaderModule,
    entry: &str,
    layout: Option<&PipelineLayout>,
) -> Result<ComputePipeline, GpuError> {
    let pipeline = gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(entry),
        layout,
        module,
        entry_point: Some(entry),
        compilation_options: PipelineCompilationOptions::default(),
        cache: None,
    });
    gpu.check()?;
    Ok(pipeline)
}

const fn buffer_kind(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub(super) const UNIFORM: BindingType = buffer_kind(BufferBindingType::Uniform);
pub(super) const READ: BindingType = buffer_kind(BufferBindingType::Storage { read_only: true });
pub(super) const WRITE: BindingType = buffer_kind(BufferBindingType::Storage { read_only: false });
/// A cube's faces.
pub(super) const FACES: BindingType = BindingType::Texture {
    sample_type: TextureSampleType::Float { filterable: false },
    view_dimension: TextureViewDimension::D2Array,
    multisampled: false,
};

/// An entry point of a module that may leave unread what its groups bind.
pub(super) fn pipeline_of(
    gpu: &Gpu,
    module: &ShaderModule,
    entry: &str,
    groups: &[Vec<(u32, BindingType)>],
) -> Result<ComputePipeline, GpuError> {
    let layout = |kinds: &Vec<(u32, BindingType)>| {
        let visibility = ShaderStages::COMPUTE;
        let entry = |&(binding, ty): &(u32, BindingType)| BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        };
        let entries: Vec<BindGroupLayoutEntry> = kinds.iter().map(entry).collect();
        gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: None, entries: &entries })
    };
    let layouts: Vec<BindGroupLayout> = groups.iter().map(layout).collect();
    let layouts: Vec<Option<&BindGroupLayout>> = layouts.iter().map(Some).collect();
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    made(gpu, module, entry, Some(&layout))
}

/// Encode a dispatch of at least `threads` threads. `groups` holds the bind groups' resources; the binding of each
/// is the number beside it.
pub(super) fn dispatch(
    gpu: &Gpu,
    encoder: &mut CommandEncoder,
    pipeline: &ComputePipeline,
    groups: &[Vec<(u32, BindingResource<'_>)>],
    threads: u64,
) {
    let bound: Vec<_> = groups
        .iter()
        .enumerate()
        .map(|(index, resources)| {
            let entries: Vec<BindGroupEntry<'_>> = resources
                .iter()
                .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.clone() })
                .collect();
            gpu.device.create_bind_group(&BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(index as u32),
                entries: &entries,
            })
        })
        .collect();
    let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
    pass.set_pipeline(pipeline);
    for (index, group) in bound.iter().enumerate() {
        pass.set_bind_group(index as u32, group, &[]);
    }
    let [x, y] = workgroups(threads);
    pass.dispatch_workgroups(x, y, 1);
}

/// Workgroups in two dimensions, of which each may have [`MOST_OF_A_DISPATCH`]: a thread's index is
/// `id.x + id.y * workgroups.x * 64`.
fn workgroups(threads: u64) -> [u32; 2] {
    let count = threads.div_ceil(u64::from(WORKGROUP)).max(1);
    let rows = count.div_ceil(u64::from(MOST_OF_A_DISPATCH));
    [count.div_ceil(rows) as u32, rows as u32]
}

/// How many workgroups a dispatch of `threads` threads has.
pub(super) fn workgroup_count(threads: u64) -> u64 {
    let [x, y] = workgroups(threads);
    u64::from(x) * u64::from(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workgroups_cover_every_thread_within_the_limit_of_each_dimension() {
        for threads in [0, 1, 64, 65, 65_535 * 64, 65_535 * 64 + 1, 10_000_000_000] {
            let [x, y] = workgroups(threads);
            assert!(x <= 65_535 && y <= 65_535 && x >= 1 && y >= 1);
            let covered = u64::from(x) * u64::from(y) * u64::from(WORKGROUP);
            assert!(covered >= threads, "{threads}");
            assert!(covered - threads <= u64::from(WORKGROUP) * u64::from(y), "{threads}");
        }
    }
}
