//! The parts that have holes or blend, as shadow maps see them: where light goes through, fragments are left out.

use std::ops::Range;
use std::sync::Arc;

use glam::DMat4;
use wgpu::{
    BindGroup, Buffer, FragmentState, MultisampleState, PipelineCompilationOptions, PipelineLayoutDescriptor,
    PrimitiveState, RenderPass, RenderPipeline, RenderPipelineDescriptor, VertexState,
};

use super::materials::Materials;
use super::placed::{Placed, layouts};
use super::text::{cast_module, casting};
use crate::compute;
use crate::constants;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::pipeline::nearest;
use crate::shader::Facts;
use crate::upload::Uploads;

/// Those parts on a device, ready to be drawn into the layers of shadow maps, in the pose that their corners are in.
pub(crate) struct Casters {
    placed: Placed,
    materials: Arc<Materials>,
    /// Corners of each material, by its place.
    runs: Vec<(u16, Range<u32>)>,
    pipeline: RenderPipeline,
    /// The constants of each layer, and they bound.
    layers: Vec<(Buffer, BindGroup)>,
}

impl Casters {
    /// Of the scene that `uploads` are of, for `layers` layers; `None` where light passes nothing of its mesh.
    ///
    /// # Errors
    /// When the adapter does not take what they read.
    pub(crate) fn new(
        gpu: &Gpu,
        facts: &Facts,
        uploads: &mut Uploads,
        layers: usize,
    ) -> Result<Option<Self>, GpuError> {
        let triangles = uploads.triangles();
        let first = 3 * (triangles.blocking - triangles.skin);
        let runs: Vec<_> = triangles.runs().filter(|(_, corners)| corners.start >= first).collect();
        if runs.is_empty() || layers == 0 {
            return Ok(None);
        }
        let plan = casting(facts).map_err(|error| GpuError::Plan(error.to_string()))?;
        let placed = Placed::new(gpu, plan, uploads.corners(gpu)?)?;
        let materials = uploads.materials(gpu)?;
        let pipeline = pipeline(gpu, &placed, &materials);
        let layers = (0..layers).map(|_| placed.constants(gpu)).collect();
        gpu.check()?;
        Ok(Some(Self { placed, materials, runs, pipeline, layers }))
    }

    /// Draw them into a layer that shows the world by that matrix.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        pass: &mut RenderPass<'_>,
        layer: usize,
        (to_clip, morph_weights): (&DMat4, &[f32]),
    ) {
        let (buffer, bound) = &self.layers[layer];
        let block = constants::outline_block(&self.placed.inputs.plan.constants, to_clip, morph_weights);
        gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&block));
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bound, &[]);
        self.placed.set_buffers(pass);
        self.materials.draw(pass, &self.runs);
    }
}

fn pipeline(gpu: &Gpu, placed: &Placed, materials: &Materials) -> RenderPipeline {
    let module = compute::module(gpu, "casters", &cast_module(&placed.inputs.plan));
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("casters"),
        bind_group_layouts: &[Some(&placed.inputs.layout), Some(materials.layout())],
        immediate_size: 0,
    });
    let attributes = placed.attributes();
    gpu.device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("casters"),
        layout: Some(&layout),
        vertex: VertexState {
            module: &module,
            entry_point: Some("cast_vertex"),
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &layouts(&attributes),
        },
        // Both sides of a triangle stop light, as on the CPU.
        primitive: PrimitiveState { cull_mode: None, ..PrimitiveState::default() },
        depth_stencil: Some(nearest()),
        multisample: MultisampleState::default(),
        fragment: Some(FragmentState {
            module: &module,
            entry_point: Some("cast_fragment"),
            compilation_options: PipelineCompilationOptions::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    })
}
