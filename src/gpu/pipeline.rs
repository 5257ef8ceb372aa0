//! A plan as a pipeline, with what it reads bound to it.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, BufferUsages, ColorTargetState,
    ColorWrites, CompareFunction, DepthBiasState, DepthStencilState, FragmentState, IndexFormat,
    MultisampleState, PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState, RenderPass,
    RenderPipeline, RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    StencilState, TextureFormat, VertexAttribute, VertexBufferLayout, VertexState, VertexStepMode,
};

use super::constants::{self, Values};
use super::device::Gpu;
use super::error::GpuError;
use super::formats::{binding_type, vertex_format};
use super::targets::DEPTH;
use super::upload::{Bound, Uploads};
use crate::shader::quantity::Kind;
use crate::shader::{Plan, Resource};

/// A plan's pipeline, and what is bound to it.
pub(super) struct Pipeline {
    pub(super) inputs: Inputs,
    pipeline: RenderPipeline,
    /// The mesh's triangles and how many indices they have; without them three vertices cover the target.
    mesh: Option<(Buffer, u32)>,
    /// Targets that it draws into.
    targets: usize,
}

/// A plan with what it reads.
pub(super) struct Inputs {
    pub(super) plan: Plan,
    pub(super) layout: BindGroupLayout,
    pub(super) bound: BindGroup,
    /// The uniform block, where the plan has constants.
    constants: Option<Buffer>,
    pub(super) attributes: Vec<Buffer>,
}

/// The stages that read it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stages {
    Raster,
    Compute,
}

/// What a pipeline draws into.
#[derive(Clone, Copy)]
pub(super) struct Outputs<'a> {
    pub(super) formats: &'a [TextureFormat],
    pub(super) multisamples: u32,
    /// Whether what is nearer hides what is behind.
    pub(super) depth: bool,
}

/// Refuse a plan that reads more of a vertex than the adapter takes: each light has numbers of its own there.
fn check_attributes(gpu: &Gpu, plan: &Plan) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let most = limits.max_vertex_buffers.min(limits.max_vertex_attributes) as usize;
    if plan.attributes.len() <= most {
        return Ok(());
    }
    let count = plan.attributes.len();
    let reason = format!(
        "the shader reads {count} attributes of a vertex, of which it takes {most}; fewer lights, or shadow maps, take fewer"
    );
    Err(GpuError::Refused { adapter: gpu.name().to_owned(), reason })
}

impl Inputs {
    /// Upload what a plan reads; `levels` are those of the atlas.
    pub(super) fn new(
        gpu: &Gpu,
        plan: Plan,
        uploads: &mut Uploads,
        levels: Vec<Bound>,
        stages: Stages,
    ) -> Result<Self, GpuError> {
        if plan.resources.contains(&Resource::ShadowMaps) {
            uploads.make_shadow_maps(gpu, &plan.facts)?;
        }
        uploads.find_fields(gpu, &plan.attributes)?;
        let attributes =
            plan.attributes.iter().map(|&a| uploads.attribute(gpu, a)).collect::<Result<Vec<_>, _>>()?;
        let mut resources =
            plan.resources.iter().map(|&r| uploads.resource(gpu, r)).collect::<Result<Vec<_>, _>>()?;
        resources.extend(levels);
        Ok(Self::of(gpu, plan, attributes, &resources, stages))
    }

    /// A plan with what it reads, in its order.
    pub(super) fn of(
        gpu: &Gpu,
        plan: Plan,
        attributes: Vec<Buffer>,
        resources: &[Bound],
        stages: Stages,
    ) -> Self {
        let constants = constant_buffer(gpu, &plan);
        let layout = layout(gpu, &plan, stages);
        let bound = bind(gpu, &layout, constants.as_ref(), resources);
        Self { plan, layout, bound, constants, attributes }
    }

    /// Set the constants of what is drawn next; they hold for all that is submitted at once. Returns them.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>) -> Vec<f32> {
        let Some(buffer) = &self.constants else { return Vec::new() };
        let block = constants::block(&self.plan.constants, values);
        gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&block));
        block
    }
}

impl Pipeline {
    /// The plan's pipeline; `levels` are those that it reads.
    pub(super) fn new(
        gpu: &Gpu,
        plan: Plan,
        uploads: &mut Uploads,
        levels: Vec<Bound>,
        outputs: Outputs<'_>,
    ) -> Result<Self, GpuError> {
        check_attributes(gpu, &plan)?;
        let inputs = Inputs::new(gpu, plan, uploads, levels, Stages::Raster)?;
        let pipeline = pipeline(gpu, &inputs.plan, &inputs.layout, outputs);
        gpu.check()?;
        let mesh =
            (!inputs.attributes.is_empty()).then(|| (uploads.indices().clone(), uploads.index_count()));
        let targets = outputs.formats.len();
        Ok(Self { inputs, pipeline, mesh, targets })
    }

    /// Targets that it draws into, depth aside.
    pub(super) const fn targets(&self) -> usize {
        self.targets
    }

    /// Draw the mesh, or over the whole target.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.inputs.bound, &[]);
        for (slot, buffer) in self.inputs.attributes.iter().enumerate() {
            pass.set_vertex_buffer(slot as u32, buffer.slice(..));
        }
        match &self.mesh {
            Some((indices, count)) => {
                pass.set_index_buffer(indices.slice(..), IndexFormat::Uint32);
                pass.draw_indexed(0..*count, 0, 0..1);
            }
            None => pass.draw(0..3, 0..1),
        }
    }
}

/// A buffer for the plan's constants; what it holds is set before each draw.
fn constant_buffer(gpu: &Gpu, plan: &Plan) -> Option<Buffer> {
    let size = constants::block_bytes(&plan.constants, plan.facts.morphs);
    (size > 0).then(|| gpu.buffer("constants", &vec![0; size], BufferUsages::UNIFORM))
}

pub(super) fn layout(gpu: &Gpu, plan: &Plan, stages: Stages) -> BindGroupLayout {
    let entry = |binding, visibility, ty| {
        let visibility = if stages == Stages::Compute { ShaderStages::COMPUTE } else { visibility };
        BindGroupLayoutEntry { binding, visibility, ty, count: None }
    };
    let constants = (!plan.constants.is_empty()).then(|| {
        let ty = BindingType::Buffer {
            ty: BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        entry(0, ShaderStages::VERTEX_FRAGMENT, ty)
    });
    let resources = plan.resources.iter().enumerate().map(|(i, resource)| {
        let kind = resource.kind();
        // Storage is what the vertex stage reads; textures and rows are the fragment stage's.
        let stage = if kind == Kind::Storage { ShaderStages::VERTEX } else { ShaderStages::FRAGMENT };
        entry(1 + i as u32, stage, binding_type(kind))
    });
    let first = 1 + plan.resources.len() as u32;
    let levels = (first..).zip(&plan.levels);
    let levels =
        levels.map(|(binding, _)| entry(binding, ShaderStages::FRAGMENT, binding_type(Kind::Texels)));
    let entries: Vec<_> = constants.into_iter().chain(resources).chain(levels).collect();
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some("plan"), entries: &entries })
}

pub(super) fn bind(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    constants: Option<&Buffer>,
    resources: &[Bound],
) -> BindGroup {
    let constants =
        constants.map(|buffer| BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() });
    let resources = resources
        .iter()
        .enumerate()
        .map(|(i, bound)| BindGroupEntry { binding: 1 + i as u32, resource: bound.binding() });
    let entries: Vec<_> = constants.into_iter().chain(resources).collect();
    gpu.device.create_bind_group(&BindGroupDescriptor { label: Some("plan"), layout, entries: &entries })
}

/// What is nearer hides what is behind.
pub(super) fn nearest() -> DepthStencilState {
    DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::Greater),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}

pub(super) fn pipeline(
    gpu: &Gpu,
    plan: &Plan,
    layout: &BindGroupLayout,
    Outputs { formats, multisamples, depth }: Outputs<'_>,
) -> RenderPipeline {
    let device = &gpu.device;
    let module = device.create_shader_module(ShaderModuleDescriptor {
        label: Some("plan"),
        source: ShaderSource::Wgsl(plan.wgsl.as_str().into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("plan"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let attributes: Vec<[VertexAttribute; 1]> = (0_u32..)
        .zip(&plan.attributes)
        .map(|(shader_location, &a)| {
            [VertexAttribute { format: vertex_format(a), offset: 0, shader_location }]
        })
        .collect();
    let buffers: Vec<_> = attributes
        .iter()
        .zip(&plan.attributes)
        .map(|(attributes, a)| {
            let step_mode = VertexStepMode::Vertex;
            Some(VertexBufferLayout { array_stride: a.bytes(), step_mode, attributes })
        })
        .collect();
    let targets: Vec<_> = formats
        .iter()
        .map(|&format| Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL }))
        .collect();
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("plan"),
        layout: Some(&pipeline_layout),
        vertex: VertexState {
            module: &module,
            entry_point: Some("vs_main"),
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &buffers,
        },
        // Both sides of a triangle are seen, as on the CPU.
        primitive: PrimitiveState { cull_mode: None, ..PrimitiveState::default() },
        depth_stencil: depth.then(nearest),
        multisample: MultisampleState { count: multisamples, ..MultisampleState::default() },
        fragment: (!targets.is_empty()).then(|| FragmentState {
            module: &module,
            entry_point: Some("fs_main"),
            compilation_options: PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
