//! A plan that compute shaders evaluate: its vertices, then which triangle each sample shows, then the samples.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, BufferDescriptor,
    BufferUsages, Color, ColorTargetState, ColorWrites, CommandEncoder, ComputePass, ComputePassDescriptor,
    ComputePipeline, ComputePipelineDescriptor, FragmentState, LoadOp, MultisampleState, Operations,
    PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState, RenderPassColorAttachment,
    RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, ShaderModule, ShaderModuleDescriptor,
    ShaderSource, ShaderStages, StorageTextureAccess, StoreOp, TextureSampleType, TextureView,
    TextureViewDimension, VertexState,
};

use super::device::Gpu;
use super::error::GpuError;
use super::pipeline::{Inputs, Stages, nearest};
use super::stage::cleared;
use super::targets::{Key, Planes, TRIANGLES, Targets, Tile};
use super::timing::Timer;
use super::upload::{Bound, Uploads};
use crate::MOST_OF_A_DISPATCH;
use crate::shader::quantity::Kind;
use crate::shader::visibility_buffer::{TILE, VERTICES};
use crate::shader::{Plan, visibility_buffer};

/// The plan on the device.
pub(super) struct VisibilityBuffer {
    pub(super) inputs: Inputs,
    vertices: ComputePipeline,
    triangles: RenderPipeline,
    shading: ComputePipeline,
    /// Attributes of all vertices, one after another; what is handed over of each; the indices, and how many.
    packed: Buffer,
    varyings: Buffer,
    corners: Buffer,
    corner_count: u32,
    /// Workgroups of vertices, across and down.
    groups: [u32; 2],
    /// Samples across and down.
    drawn: Buffer,
    vertices_bound: BindGroup,
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
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let buffer = |label, size| {
            gpu.device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let count = uploads.vertex_count();
        let groups = count.div_ceil(u64::from(VERTICES)) as u32;
        let across = groups.clamp(1, MOST_OF_A_DISPATCH);
        let packed = buffer("attributes", inputs.attributes.iter().map(Buffer::size).sum::<u64>().max(4));
        let varyings = buffer("varyings", 4 * count * modules.stride as u64);
        let drawn = gpu.buffer("drawn", &[0; 16], BufferUsages::UNIFORM);
        let corners = uploads.indices().clone();
        let (compute, vertex) = (ShaderStages::COMPUTE, ShaderStages::VERTEX);
        let vertices_layout = layout(gpu, "vertices", &[(compute, storage(true)), (compute, storage(false))]);
        let triangles_layout = layout(gpu, "triangles", &[(vertex, storage(true)), (vertex, storage(true))]);
        let shading_layout = layout(gpu, "shading", &shading_entries(key));
        let module = |text: &str| module(gpu, text);
        let compute = |entry: &str, text: &str, own: &BindGroupLayout| {
            compute_pipeline(gpu, entry, &module(text), &[&inputs.layout, own])
        };
        let made = Self {
            vertices: compute("cs_vertices", &modules.vertices, &vertices_layout),
            triangles: triangles_pipeline(gpu, &module(&modules.triangles), &triangles_layout),
            shading: compute("cs_shade", &modules.shading, &shading_layout),
            vertices_bound: bind(
                gpu,
                &vertices_layout,
                vec![packed.as_entire_binding(), varyings.as_entire_binding()],
            ),
            triangles_bound: bind(
                gpu,
                &triangles_layout,
                vec![varyings.as_entire_binding(), corners.as_entire_binding()],
            ),
            inputs,
            packed,
            varyings,
            corners,
            corner_count: uploads.index_count(),
            groups: [across, groups.div_ceil(across)],
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
        // A pose's own: they may have been written since.
        let mut first = 0;
        for attribute in &self.inputs.attributes {
            encoder.copy_buffer_to_buffer(attribute, 0, &self.packed, first, attribute.size());
            first += attribute.size();
        }
        self.place_vertices(encoder, timer.as_deref_mut());
        self.find_triangles(encoder, triangles, &targets.depth, (width, height), timer.as_deref_mut());
        let mut resources = vec![
            self.varyings.as_entire_binding(),
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

    fn place_vertices(&self, encoder: &mut CommandEncoder, timer: Option<&mut Timer>) {
        let mut pass = compute_pass(encoder, "vertices", timer);
        pass.set_pipeline(&self.vertices);
        pass.set_bind_group(0, &self.inputs.bound, &[]);
        pass.set_bind_group(1, &self.vertices_bound, &[]);
        pass.dispatch_workgroups(self.groups[0], self.groups[1], 1);
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

const fn storage(read_only: bool) -> BindingType {
    let ty = BufferBindingType::Storage { read_only };
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn layout(gpu: &Gpu, label: &str, entries: &[(ShaderStages, BindingType)]) -> BindGroupLayout {
    let entry = |(binding, &(visibility, ty))| BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<BindGroupLayoutEntry> = (0..).zip(entries).map(entry).collect();
    let label = Some(label);
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label, entries: &entries })
}

fn bind(gpu: &Gpu, layout: &BindGroupLayout, resources: Vec<BindingResource<'_>>) -> BindGroup {
    let entry = |(binding, resource)| BindGroupEntry { binding, resource };
    let entries: Vec<BindGroupEntry<'_>> = (0..).zip(resources).map(entry).collect();
    gpu.device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn module(gpu: &Gpu, text: &str) -> ShaderModule {
    gpu.device.create_shader_module(ShaderModuleDescriptor {
        label: Some("visibility buffer"),
        source: ShaderSource::Wgsl(text.into()),
    })
}

fn compute_pass<'a>(
    encoder: &'a mut CommandEncoder,
    label: &'static str,
    mut timer: Option<&mut Timer>,
) -> ComputePass<'a> {
    let timestamp_writes = timer.as_mut().and_then(|timer| timer.around_compute(label));
    encoder.begin_compute_pass(&ComputePassDescriptor { label: Some(label), timestamp_writes })
}

fn compute_pipeline(
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
