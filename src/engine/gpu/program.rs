//! The shaders of a wish as pipelines, and one run of them.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, BufferDescriptor, BufferUsages,
    CommandEncoder, CommandEncoderDescriptor, ComputePassDescriptor, ComputePipeline,
    ComputePipelineDescriptor, PipelineCompilationOptions, PipelineLayoutDescriptor, ShaderModuleDescriptor,
    ShaderSource, ShaderStages, TextureSampleType, TextureViewDimension,
};

use super::lights::DeviceLights;
use super::parts::{PART_BYTES, Part, Parts};
use crate::engine::view::ObservedView;
use crate::gpu::readback::map;
use crate::gpu::{Gpu, GpuError};
use crate::shader::fused::{ColumnOf, Fused, PARTS, Slab, Sum, Wish, gather_module};
use crate::shader::{Constant, Resource};

/// The shaders of a wish.
pub(super) struct Program {
    fused: Fused,
    slabs: Vec<(Slab, ComputePipeline)>,
    gather: ComputePipeline,
    layouts: [BindGroupLayout; 3],
    constants: Option<Buffer>,
    lights: Option<(u64, BindGroup)>,
    /// For each slab and part: where its sums stand, and the bindings of both shaders.
    runs: Vec<Run>,
    results: Buffer,
    readback: Buffer,
}

/// One slab over one part.
struct Run {
    slab: usize,
    part: usize,
    first_sum: u32,
    first_result: usize,
    block: Buffer,
    bindings: BindGroup,
    gather: BindGroup,
    counts: Buffer,
}

impl Program {
    pub(super) fn new(gpu: &Gpu, fused: Fused, wish: Wish, parts: &Parts) -> Result<Self, GpuError> {
        let layouts = [lights_layout(gpu, &fused), part_layout(gpu), gather_layout(gpu)];
        let slabs: Vec<(Slab, ComputePipeline)> = fused
            .slabs(wish)
            .into_iter()
            .map(|slab| {
                let made = pipeline(gpu, "fused pass", &slab.wgsl, &[&layouts[0], &layouts[1]]);
                (slab, made)
            })
            .collect();
        let gather = pipeline(gpu, "gather", &gather_module(), &[&layouts[2]]);
        gpu.check()?;
        let buffer = |label, bytes: usize, usage| {
            let size = (bytes as u64).max(16);
            gpu.device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let constants = (!fused.plan.constants.is_empty()).then(|| {
            buffer(
                "constants",
                16 * fused.plan.constants.len(),
                BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            )
        });
        let (mut sums, mut results) = (0, 0);
        let mut places = Vec::new();
        for (s, (slab, _)) in slabs.iter().enumerate() {
            for (p, part) in parts.parts.iter().enumerate() {
                places.push((s, p, sums, results));
                sums += slab.sums.len() * Parts::most_workgroups(part) as usize;
                results += slab.sums.len() * PARTS;
            }
        }
        let partial_sums = buffer("partial sums", 4 * sums, BufferUsages::STORAGE);
        let results_buffer = buffer("sums", 4 * results, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let readback = buffer("sums read", 4 * results, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let runs = places.into_iter().map(|(slab, part, first_sum, first_result)| {
            let counts = buffer("counts", 16, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
            let block = buffer("part", PART_BYTES, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
            let of = &parts.parts[part].buffers;
            let bindings =
                bind(gpu, &layouts[1], &[&block, &of.samples, &of.group_start, &of.targets, &partial_sums]);
            let gather = bind(gpu, &layouts[2], &[&counts, &partial_sums, &results_buffer]);
            Run { slab, part, first_sum: first_sum as u32, first_result, block, bindings, gather, counts }
        });
        let runs = runs.collect();
        gpu.check()?;
        Ok(Self {
            fused,
            slabs,
            gather,
            layouts,
            constants,
            lights: None,
            runs,
            results: results_buffer,
            readback,
        })
    }

    pub(super) fn columns(&self) -> &[ColumnOf] {
        &self.fused.columns
    }

    pub(super) fn resources(&self) -> &[Resource] {
        &self.fused.plan.resources
    }

    pub(super) fn constants(&self) -> &[Constant] {
        &self.fused.plan.constants
    }

    pub(super) fn set_constants(&self, gpu: &Gpu, block: &[f32]) {
        if let Some(buffer) = &self.constants {
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(block));
        }
    }

    /// Bind the cubes, unless those are bound already.
    pub(super) fn bind_lights(&mut self, gpu: &Gpu, lights: &DeviceLights) -> Result<(), GpuError> {
        if self.lights.as_ref().is_some_and(|(version, _)| *version == lights.version()) {
            return Ok(());
        }
        let mut entries = Vec::new();
        if let Some(buffer) = &self.constants {
            entries.push(BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() });
        }
        for (i, &resource) in self.fused.plan.resources.iter().enumerate() {
            let view = lights.view(gpu, resource)?;
            entries.push(BindGroupEntry {
                binding: i as u32 + 1,
                resource: wgpu::BindingResource::TextureView(view),
            });
        }
        let layout = &self.layouts[0];
        let descriptor = BindGroupDescriptor { label: Some("lights"), layout, entries: &entries };
        self.lights = Some((lights.version(), gpu.device.create_bind_group(&descriptor)));
        gpu.check()
    }

    /// One pass over all parts: for each, its sums.
    pub(super) fn run(
        &self,
        gpu: &Gpu,
        parts: &Parts,
        views: &[ObservedView],
        gains: &[f64],
    ) -> Result<Vec<Vec<(Sum, f64)>>, GpuError> {
        let mut encoder = encoder(gpu);
        for run in &self.runs {
            let part = &parts.parts[run.part];
            let gain = gains.get(part.view).copied().unwrap_or(1.0);
            if Parts::is_streamed(part) {
                // Its buffers may still be read by the part before it.
                gpu.queue.submit([std::mem::replace(&mut encoder, self::encoder(gpu)).finish()]);
                gpu.wait()?;
                parts.stream(gpu, views, part)?;
            }
            gpu.queue.write_buffer(&run.block, 0, &parts.block(views, part, gain, run.first_sum));
            self.encode(gpu, &mut encoder, run, part);
        }
        encoder.copy_buffer_to_buffer(&self.results, 0, &self.readback, 0, self.results.size());
        gpu.queue.submit([encoder.finish()]);
        let slice = self.readback.slice(..);
        map(gpu, &slice)?;
        let sums = {
            let view = slice.get_mapped_range().map_err(|error| gpu.lost(&error.to_string()))?;
            self.collect(bytemuck::cast_slice(&view), parts.parts.len())
        };
        self.readback.unmap();
        Ok(sums)
    }

    fn encode(&self, gpu: &Gpu, encoder: &mut CommandEncoder, run: &Run, part: &Part) {
        let (slab, pipeline) = &self.slabs[run.slab];
        let workgroups = Parts::workgroups(part);
        let counts = [workgroups, run.first_sum, run.first_result as u32, 0];
        gpu.queue.write_buffer(&run.counts, 0, bytemuck::cast_slice(&counts));
        let Some((_, lights)) = &self.lights else { return };
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, lights, &[]);
        pass.set_bind_group(1, &run.bindings, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
        pass.set_pipeline(&self.gather);
        pass.set_bind_group(0, &run.gather, &[]);
        pass.dispatch_workgroups(slab.sums.len() as u32, 1, 1);
    }

    /// The last additions, in f64.
    fn collect(&self, numbers: &[f32], parts: usize) -> Vec<Vec<(Sum, f64)>> {
        let mut sums = vec![Vec::new(); parts];
        for run in &self.runs {
            let (slab, _) = &self.slabs[run.slab];
            for (k, &sum) in slab.sums.iter().enumerate() {
                let parts = &numbers[run.first_result + k * PARTS..][..PARTS];
                sums[run.part].push((sum, parts.iter().map(|&x| f64::from(x)).sum()));
            }
        }
        sums
    }
}

fn encoder(gpu: &Gpu) -> CommandEncoder {
    gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("fused pass") })
}

fn pipeline(gpu: &Gpu, label: &str, wgsl: &str, layouts: &[&BindGroupLayout]) -> ComputePipeline {
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

fn bind(gpu: &Gpu, layout: &BindGroupLayout, buffers: &[&Buffer]) -> BindGroup {
    let entry = |(i, buffer): (usize, &&Buffer)| -> (u32, Buffer) { (i as u32, (*buffer).clone()) };
    let held: Vec<(u32, Buffer)> = buffers.iter().enumerate().map(entry).collect();
    let entries: Vec<BindGroupEntry<'_>> = held
        .iter()
        .map(|(binding, buffer)| BindGroupEntry { binding: *binding, resource: buffer.as_entire_binding() })
        .collect();
    gpu.device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn layout(gpu: &Gpu, label: &str, kinds: &[(u32, BindingType)]) -> BindGroupLayout {
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

const UNIFORM: BindingType = buffer_kind(BufferBindingType::Uniform);
const READ: BindingType = buffer_kind(BufferBindingType::Storage { read_only: true });
const WRITE: BindingType = buffer_kind(BufferBindingType::Storage { read_only: false });

/// Group 0: the plan's constants and cubes.
fn lights_layout(gpu: &Gpu, fused: &Fused) -> BindGroupLayout {
    let faces = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: false },
        view_dimension: TextureViewDimension::D2Array,
        multisampled: false,
    };
    let constants = (!fused.plan.constants.is_empty()).then_some((0, UNIFORM));
    let cubes = (1..=fused.plan.resources.len() as u32).map(|binding| (binding, faces));
    layout(gpu, "lights", &constants.into_iter().chain(cubes).collect::<Vec<_>>())
}

fn part_layout(gpu: &Gpu) -> BindGroupLayout {
    layout(gpu, "part", &[(0, UNIFORM), (1, READ), (2, READ), (3, READ), (4, WRITE)])
}

fn gather_layout(gpu: &Gpu) -> BindGroupLayout {
    layout(gpu, "gather", &[(0, UNIFORM), (1, READ), (2, WRITE)])
}
