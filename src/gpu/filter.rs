//! Passes over whole images: one triangle that covers the target, shaded by a fragment program.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType, ColorTargetState, ColorWrites,
    FragmentState, MultisampleState, PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState,
    RenderPass, RenderPipeline, RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    TextureFormat, TextureSampleType, TextureViewDimension, VertexState,
};

use super::device::Gpu;

/// A fragment program over an image; its vertex program is `fullscreen.wgsl`.
pub(super) struct Filter {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
}

/// What a filter reads, in the order of its bindings.
#[derive(Clone, Copy)]
pub(super) enum Input {
    /// `texture_2d<f32>`, read texel by texel.
    Texels,
    /// A uniform buffer.
    Uniform,
}

impl Filter {
    /// The program `entry` of `wgsl`, with its override constants.
    pub(super) fn new(
        gpu: &Gpu,
        (wgsl, entry): (&str, &str),
        constants: &[(&str, f64)],
        inputs: &[Input],
        formats: &[TextureFormat],
    ) -> Self {
        let device = &gpu.device;
        let text = format!("{}\n{wgsl}", include_str!("wgsl/fullscreen.wgsl"));
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some(entry),
            source: ShaderSource::Wgsl(text.into()),
        });
        let entries: Vec<BindGroupLayoutEntry> =
            inputs.iter().enumerate().map(|(i, &input)| layout_entry(i as u32, input)).collect();
        let layout = device
            .create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(entry), entries: &entries });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some(entry),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let targets: Vec<_> = formats
            .iter()
            .map(|&format| Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL }))
            .collect();
        let options = PipelineCompilationOptions { constants, ..PipelineCompilationOptions::default() };
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some(entry),
            layout: Some(&pipeline_layout),
            vertex: VertexState {
                module: &module,
                entry_point: Some("whole_target"),
                compilation_options: options.clone(),
                buffers: &[],
            },
            primitive: PrimitiveState::default(),
            depth_stencil: None,
            multisample: MultisampleState::default(),
            fragment: Some(FragmentState {
                module: &module,
                entry_point: Some(entry),
                compilation_options: options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, layout }
    }

    /// What it is to read.
    pub(super) fn bind(&self, gpu: &Gpu, inputs: Vec<BindingResource<'_>>) -> BindGroup {
        let entry = |(i, resource)| BindGroupEntry { binding: i as u32, resource };
        let entries: Vec<BindGroupEntry<'_>> = inputs.into_iter().enumerate().map(entry).collect();
        let (label, layout) = (Some("filter"), &self.layout);
        gpu.device.create_bind_group(&BindGroupDescriptor { label, layout, entries: &entries })
    }

    /// Draw over the whole target of `pass`.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, bound: &BindGroup) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bound, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn layout_entry(binding: u32, input: Input) -> BindGroupLayoutEntry {
    let ty = match input {
        Input::Texels => BindingType::Texture {
            sample_type: TextureSampleType::Float { filterable: false },
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        },
        Input::Uniform => BindingType::Buffer {
            ty: BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    };
    BindGroupLayoutEntry { binding, visibility: ShaderStages::FRAGMENT, ty, count: None }
}
