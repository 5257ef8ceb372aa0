//! The compute shaders behind the rasteriser.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindingResource, Buffer, BufferDescriptor, BufferUsages,
    CommandEncoder, ComputePassDescriptor, ComputePipeline, ComputePipelineDescriptor,
    PipelineCompilationOptions, ShaderModuleDescriptor, ShaderSource,
};

use super::draw::WORKGROUP;
use super::surfaces::Surfaces;
use crate::MOST_OF_A_DISPATCH;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::readback::read_words;

/// Threads of a workgroup of `coverage.wgsl`.
const COVERAGE_THREADS: u32 = 64;

/// Packs a bit for each sample that was drawn.
pub(super) struct Coverage(ComputePipeline);

impl Coverage {
    pub(super) fn new(gpu: &Gpu) -> Self {
        Self(pipeline(gpu, "coverage", include_str!("../wgsl/coverage.wgsl")))
    }

    /// After the encoder's commands: the words of `width` x `height` samples, row by row.
    pub(super) fn read(
        &self,
        gpu: &Gpu,
        mut encoder: CommandEncoder,
        surfaces: &Surfaces,
        [width, height]: [u32; 2],
    ) -> Result<Vec<u32>, GpuError> {
        let words = width.div_ceil(u32::BITS);
        let size = gpu.buffer("size", bytemuck::bytes_of(&[width, height, words, 0]), BufferUsages::UNIFORM);
        let packed = gpu.device.create_buffer(&BufferDescriptor {
            label: Some("coverage"),
            size: 4 * u64::from(words) * u64::from(height),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let resources = vec![
            size.as_entire_binding(),
            BindingResource::TextureView(&surfaces.depth),
            packed.as_entire_binding(),
        ];
        let bound = bind(gpu, &self.0, resources);
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(&self.0);
            pass.set_bind_group(0, &bound, &[]);
            pass.dispatch_workgroups(words.div_ceil(COVERAGE_THREADS), height, 1);
        }
        gpu.check()?;
        read_words(gpu, encoder, &packed)
    }
}

/// Takes a draw's numbers to records.
pub(super) struct Gather {
    pipeline: ComputePipeline,
    targets: usize,
}

impl Gather {
    pub(super) fn new(gpu: &Gpu, wgsl: &str, targets: usize) -> Self {
        Self { pipeline: pipeline(gpu, "gather samples", wgsl), targets }
    }

    /// Targets that it reads.
    pub(super) const fn targets(&self) -> usize {
        self.targets
    }

    /// Take the texels of targets `width` wide that `sources` name to `records`.
    pub(super) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        surfaces: &Surfaces,
        width: u32,
        sources: &Buffer,
        records: &Buffer,
    ) {
        let slots = (sources.size() / 8) as u32;
        let counts = gpu.buffer("counts", bytemuck::bytes_of(&[slots, width, 0, 0]), BufferUsages::UNIFORM);
        let mut resources =
            vec![counts.as_entire_binding(), sources.as_entire_binding(), records.as_entire_binding()];
        resources.extend(surfaces.targets.iter().take(self.targets).map(BindingResource::TextureView));
        let bound = bind(gpu, &self.pipeline, resources);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.dispatch_workgroups(slots.div_ceil(WORKGROUP).clamp(1, MOST_OF_A_DISPATCH), 1, 1);
    }
}

fn pipeline(gpu: &Gpu, label: &str, wgsl: &str) -> ComputePipeline {
    let module = gpu.device.create_shader_module(ShaderModuleDescriptor {
        label: Some(label),
        source: ShaderSource::Wgsl(wgsl.into()),
    });
    gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(label),
        layout: None,
        module: &module,
        entry_point: Some("cs_main"),
        compilation_options: PipelineCompilationOptions::default(),
        cache: None,
    })
}

fn bind(gpu: &Gpu, pipeline: &ComputePipeline, resources: Vec<BindingResource<'_>>) -> BindGroup {
    let entry = |(binding, resource)| BindGroupEntry { binding, resource };
    let entries: Vec<BindGroupEntry<'_>> = (0..).zip(resources).map(entry).collect();
    gpu.device.create_bind_group(&BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
}
