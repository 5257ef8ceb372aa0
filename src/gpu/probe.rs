//! Rules evaluated on the device for given numbers, as the conformance tests do.

use wgpu::util::{BufferInitDescriptor, DeviceExt as _};
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BufferDescriptor, BufferUsages, CommandEncoderDescriptor,
    ComputePassDescriptor, ComputePipelineDescriptor, PipelineCompilationOptions, ShaderModuleDescriptor,
    ShaderSource,
};

use super::constants::{self, Values};
use super::device::Gpu;
use super::error::GpuError;
use super::readback::read_floats;
use super::targets::Tile;
use super::upload::{Content, Uploads};
use crate::model::params::Params;
use crate::scene::view::Camera;
use crate::shader::probe::{Probe, WORKGROUP};

/// The uniform block of a probe's plan at `params`: the eye at the origin, no morph targets.
#[must_use]
pub fn constants(probe: &Probe, params: &Params) -> Vec<f32> {
    let camera = Camera::pinhole(glam::DMat4::IDENTITY, 1.0, [1, 1]);
    let tile = Tile { x: 0, y: 0, width: 1, height: 1 };
    constants::block(&probe.plan.constants, &Values { params, camera: &camera, tile, morph_weights: &[] })
}

/// What the probe yields for each item of `given` ([`Probe::stride`] numbers each): [`Probe::width`] numbers
/// an item. Resources come from `content`, whose active morph targets are summed; `constants` is the
/// plan's uniform block.
///
/// # Errors
/// When the device does not take it.
pub fn evaluate(
    gpu: &Gpu,
    probe: &Probe,
    content: Content,
    constants: &[f32],
    given: &[f32],
) -> Result<Vec<f32>, GpuError> {
    let morphs = &content.scene.mesh.morphs;
    let targets = (0..morphs.len()).filter(|&i| morphs[i].weight != 0.0).collect();
    let mut uploads = Uploads::new(gpu, content, targets)?;
    let resources =
        probe.plan.resources.iter().map(|&r| uploads.resource(gpu, r)).collect::<Result<Vec<_>, _>>()?;
    let items = given.len() / probe.stride();
    let module = gpu.device.create_shader_module(ShaderModuleDescriptor {
        label: Some("probe"),
        source: ShaderSource::Wgsl(probe.plan.wgsl.as_str().into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some("probe"),
        layout: None,
        module: &module,
        entry_point: Some("cs_main"),
        compilation_options: PipelineCompilationOptions::default(),
        cache: None,
    });
    gpu.check()?;
    let buffer = |label, numbers: &[f32], usage| {
        let contents = bytemuck::cast_slice(numbers);
        gpu.device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
    };
    let block = (!constants.is_empty()).then(|| buffer("constants", constants, BufferUsages::UNIFORM));
    let input = buffer("given", given, BufferUsages::STORAGE);
    let output = gpu.device.create_buffer(&BufferDescriptor {
        label: Some("wanted"),
        size: (4 * items * probe.width()) as u64,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut entries: Vec<BindGroupEntry<'_>> = Vec::new();
    entries.extend(block.as_ref().map(|b| BindGroupEntry { binding: 0, resource: b.as_entire_binding() }));
    let bound = resources.iter().map(super::upload::Bound::binding);
    let buffers = [input.as_entire_binding(), output.as_entire_binding()];
    entries.extend(
        (1..).zip(bound.chain(buffers)).map(|(binding, resource)| BindGroupEntry { binding, resource }),
    );
    let group = gpu.device.create_bind_group(&BindGroupDescriptor {
        label: Some("probe"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("probe") });
    {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((items as u32).div_ceil(WORKGROUP), 1, 1);
    }
    read_floats(gpu, encoder, &output)
}
