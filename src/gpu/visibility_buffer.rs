//! A plan that compute shaders evaluate: its vertices, then which triangle each sample shows, then the samples.

use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, BindingType, Buffer, BufferBindingType, BufferUsages, Color,
    ColorTargetState, ColorWrites, CommandEncoder, ComputePipeline, FragmentState, LoadOp, MultisampleState,
    Operations, PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState,
    RenderPassColorAttachment, RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, ShaderModule,
    ShaderStages, StorageTextureAccess, StoreOp, TextureSampleType, TextureView, TextureViewDimension,
    VertexState,
};

use super::compute::{VertexStage, bind, compute_pass, layout, module, pipeline, storage};
use super::device::Gpu;
use super::error::GpuError;
use super::pipeline::{Inputs, Stages, nearest};
use super::stage::cleared;
use super::targets::{Key, Planes, TRIANGLES, Targets, Tile};
use super::timing::Timer;
use super::upload::{Bound, Uploads};
use crate::shader::quantity::Kind;
use crate::shader::visibility_buffer::TILE;
use crate::shader::{Plan, visibility_buffer};

/// The plan on the device.
pub(super) struct VisibilityBuffer {
    pub(super) inputs: Inputs,
    vertices: VertexStage,
    triangles: RenderPipeline,
    shading: ComputePipeline,
    /// The indices, and how many.
    corners: Buffer,
    corner_count: u32,
    /// Samples across and down.
    drawn: Buffer,
    triangles_bound: BindGroup,
    shading_layout: BindGroupLayout,
}

impl VisibilityBuffer {
    /// Compile `modules` of the plan, for targets of `key`; `levels` are those of the atlas that it reads.
    ///
    /// # Errors
    /// When the device does not take them, or what they read.
    pub(super) fn new(
        gpu: &Gpu,
        plan: Plan,
        modules: &visibility_buffer::VisibilityBuffer,
        uploads: &mut Uploads,
        levels: Vec<Bound>,
        key: &Key,
    ) -> Result<Self, GpuError> {
        let inputs = Inputs::new(gpu, plan, uploads, levels, Stages::Compute)?;
        let drawn = gpu.buffer("drawn", &[0; 16], BufferUsages::UNIFORM);
        let corners = uploads.indices().clone();
        let vertex = ShaderStages::VERTEX;
        let triangles_layout = layout(gpu, "triangles", &[(vertex, storage(true)), (vertex, storage(true))]);
        let shading_layout = layout(gpu, "shading", &shading_entries(key));
        let module = |text: &str| module(gpu, "visibility buffer", text);
        let vertices = VertexStage::new(gpu, &inputs, &module(&modules.vertices), modules.stride, uploads);
        let shading = module(&modules.shading);
        let made = Self {
            triangles: triangles_pipeline(gpu, &module(&modules.triangles), &triangles_layout),
            shading: pipeline(gpu, "cs_shade", &shading, &[&inputs.layout, &shading_layout]),
            triangles_bound: bind(
                gpu,
                &triangles_layout,
                vec![vertices.varyings.as_entire_binding(), corners.as_entire_binding()],
            ),
            vertices,
            inputs,
            corners,
            corner_count: uploads.index_count(),
            drawn,
            shading_layout,
        };
        gpu.check()?;
        Ok(made)
    }

    /// Shade a tile's samples into `planes` of the targets.
    pub(super) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        (targets, planes): (&Targets, &Planes),
        tile: Tile,
        mut timer: Option<&mut Timer>,
    ) {
        let Some(triangles) = &targets.triangles else { return };
        let n = targets.key.antialias.grid();
        let (width, height) = (n * tile.width, n * tile.height);
        gpu.queue.write_buffer(&self.drawn, 0, bytemuck::cast_slice(&[width, height, 0, 0]));
        self.vertices.pack(encoder, &self.inputs);
        {
            let mut pass = compute_pass(encoder, "vertices", timer.as_deref_mut());
            self.vertices.run(&mut pass, &self.inputs);
        }
        self.find_triangles(encoder, triangles, &targets.depth, (width, height), timer.as_deref_mut());
        let mut resources = vec![
            self.vertices.varyings.as_entire_binding(),
            self.corners.as_entire_binding(),
            BindingResource::TextureView(triangles),
            self.drawn.as_entire_binding(),
        ];
        resources.extend(planes.views().map(BindingResource::TextureView));
        let bound = bind(gpu, &self.shading_layout, resources);
        let mut pass = compute_pass(encoder, "shading", timer);
        pass.set_pipeline(&self.shading);
        pass.set_bind_group(0, &self.inputs.bound, &[]);
        pass.set_bind_group(1, &bound, &[]);
        pass.dispatch_workgroups(width.div_ceil(TILE), height.div_ceil(TILE), 1);
    }

    fn find_triangles(
        &self,
        encoder: &mut CommandEncoder,
        triangles: &TextureView,
        depth: &TextureView,
        (width, height): (u32, u32),
        mut timer: Option<&mut Timer>,
    ) {
        let ops = Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store };
        let target =
            RenderPassColorAttachment { view: triangles, depth_slice: None, resolve_target: None, ops };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("triangles"),
            color_attachments: &[Some(target)],
            depth_stencil_attachment: Some(cleared(depth)),
            timestamp_writes: timer.as_mut().and_then(|timer| timer.around("triangles")),
            ..RenderPassDescriptor::default()
        });
        pass.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 1.0);
        pass.set_pipeline(&self.triangles);
        pass.set_bind_group(0, &self.triangles_bound, &[]);
        pass.draw(0..self.corner_count, 0..1);
    }
}

/// Whether the device takes a plan's modules: their bindings, and buffers of that size.
pub(super) fn fits(
    gpu: &Gpu,
    plan: &Plan,
    modules: &visibility_buffer::VisibilityBuffer,
    uploads: &Uploads,
) -> bool {
    let limits = gpu.device.limits();
    let of = |kinds: &[Kind]| plan.resources.iter().filter(|r| kinds.contains(&r.kind())).count();
    let buffers = of(&[Kind::Storage, Kind::Rows]);
    let textures = plan.resources.len() - buffers - of(&[Kind::Sampler, Kind::Comparison]);
    // Group 1 holds two buffers and a texture beside what the plan reads.
    let bound = buffers + 2 <= limits.max_storage_buffers_per_shader_stage as usize
        && textures + plan.levels.len() < limits.max_sampled_textures_per_shader_stage as usize;
    let read: u64 = plan.attributes.iter().map(|attribute| attribute.bytes()).sum();
    let vertices = uploads.vertex_count() * read.max(4 * modules.stride as u64);
    let largest = vertices.max(4 * u64::from(uploads.index_count()));
    bound && largest <= limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// What `cs_shade` reads and writes in group 1.
fn shading_entries(key: &Key) -> Vec<(ShaderStages, BindingType)> {
    let triangles = BindingType::Texture {
        sample_type: TextureSampleType::Uint,
        view_dimension: TextureViewDimension::D2,
        multisampled: false,
    };
    let drawn = BindingType::Buffer {
        ty: BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let target = |format| BindingType::StorageTexture {
        access: StorageTextureAccess::WriteOnly,
        format,
        view_dimension: TextureViewDimension::D2,
    };
    let entries = [storage(true), storage(true), triangles, drawn];
    let entries = entries.into_iter().chain(key.formats().into_iter().map(target));
    entries.map(|entry| (ShaderStages::COMPUTE, entry)).collect()
}

fn triangles_pipeline(gpu: &Gpu, module: &ShaderModule, layout: &BindGroupLayout) -> RenderPipeline {
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("triangles"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let target = ColorTargetState { format: TRIANGLES, blend: None, write_mask: ColorWrites::ALL };
    gpu.device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("triangles"),
        layout: Some(&layout),
        vertex: VertexState {
            module,
            entry_point: Some("vs_main"),
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &[],
        },
        // Both sides of a triangle are seen, as on the CPU.
        primitive: PrimitiveState { cull_mode: None, ..PrimitiveState::default() },
        depth_stencil: Some(nearest()),
        multisample: MultisampleState::default(),
        fragment: Some(FragmentState {
            module,
            entry_point: Some("fs_main"),
            compilation_options: PipelineCompilationOptions::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
