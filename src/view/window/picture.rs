//! Images on the window's own device: float textures, shown by picture.wgsl.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use eframe::{egui, egui_wgpu};
use wgpu::util::{BufferInitDescriptor, DeviceExt as _, TextureDataOrder};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType, BufferUsages, CommandBuffer,
    CommandEncoder, Device, Extent3d, FragmentState, PipelineLayoutDescriptor, Queue, RenderPass,
    RenderPipeline, RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureView,
    TextureViewDescriptor, TextureViewDimension, VertexState,
};

use crate::look::ErrorKind;
use crate::pixels::ramp;
use crate::render::image::Image;
use crate::render::tonemap::Operator;
use crate::report::pictures::BACKGROUND;
use crate::shown::Kind;

/// Textures that are kept; the one that was shown longest ago goes.
const MOST: usize = 16;

/// How it is shown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shown {
    pub(crate) kind: Kind,
    /// The image's point at the pane's upper left, and how many of its pixels the pane is across.
    pub(crate) origin: [f32; 2],
    pub(crate) span: [f32; 2],
    /// Stops.
    pub(crate) exposure: f32,
    pub(crate) operator: Operator,
    pub(crate) false_colour: bool,
    /// What the end of an error's scale stands for.
    pub(crate) scale: f32,
}

/// `struct Look` of picture.wgsl.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Block {
    origin: [f32; 2],
    span: [f32; 2],
    step: [f32; 2],
    exposure: f32,
    scale: f32,
    wipe: f32,
    line: f32,
    background: f32,
    kind: u32,
    operator: u32,
    false_colour: u32,
    encoded: u32,
    pad: u32,
}

/// Have a pane's image painted into `rect`; `id` is the pane's own.
pub(crate) fn paint(
    painter: &egui::Painter,
    rect: egui::Rect,
    id: egui::Id,
    images: [Arc<Image>; 2],
    shown: Shown,
) {
    let pixels = (rect.size() * painter.pixels_per_point()).max(egui::Vec2::splat(1.0));
    let pane = Pane { id, images, shown, pixels };
    painter.add(Callback::new_paint_callback(rect, pane));
}

struct Pane {
    id: egui::Id,
    images: [Arc<Image>; 2],
    shown: Shown,
    pixels: egui::Vec2,
}

/// What all panes share on the device.
struct Shared {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
    ramps: TextureView,
    encoded: bool,
    /// By the place of the image in memory, which is its own for as long as it is kept here.
    textures: HashMap<usize, (Arc<Image>, TextureView, u64)>,
    clock: u64,
    groups: HashMap<egui::Id, BindGroup>,
}

/// Make what panes share, once.
pub(crate) fn install(state: &egui_wgpu::RenderState) {
    let shared = Shared::new(&state.device, &state.queue, state.target_format);
    state.renderer.write().callback_resources.insert(shared);
}

impl Shared {
    fn new(device: &Device, queue: &Queue, format: TextureFormat) -> Self {
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("picture"),
            source: ShaderSource::Wgsl(include_str!("picture.wgsl").into()),
        });
        let texture = |binding| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::FRAGMENT,
            ty: BindingType::Texture {
                sample_type: TextureSampleType::Float { filterable: false },
                view_dimension: TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let uniform = BindGroupLayoutEntry {
            binding: 0,
            visibility: ShaderStages::FRAGMENT,
            ty: BindingType::Buffer {
                ty: BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("picture"),
            entries: &[uniform, texture(1), texture(2), texture(3)],
        });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("picture"),
            bind_group_layouts: &[Some(&layout)],
            ..PipelineLayoutDescriptor::default()
        });
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("picture"),
            layout: Some(&pipeline_layout),
            vertex: VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            fragment: Some(FragmentState {
                module: &module,
                entry_point: Some("pixel"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            multiview_mask: None,
            cache: None,
        });
        let bytes = [false, true].map(ramp).concat();
        let ramps = upload(device, queue, "ramps", [256, 2], TextureFormat::Rgba8Unorm, &bytes);
        let encoded = !format.is_srgb();
        Self { pipeline, layout, ramps, encoded, textures: HashMap::new(), clock: 0, groups: HashMap::new() }
    }

    fn view(&mut self, device: &Device, queue: &Queue, image: &Arc<Image>) -> TextureView {
        self.clock += 1;
        let key = Arc::as_ptr(image) as usize;
        if let Some((_, view, used)) = self.textures.get_mut(&key) {
            *used = self.clock;
            return view.clone();
        }
        if self.textures.len() >= MOST
            && let Some(oldest) =
                self.textures.iter().min_by_key(|(_, (.., used))| *used).map(|(key, _)| *key)
        {
            self.textures.remove(&oldest);
        }
        let texels: Vec<[f32; 4]> =
            image.rgb.iter().zip(&image.alpha).map(|(&[r, g, b], &a)| [r, g, b, a]).collect();
        let size = [image.width as u32, image.height as u32];
        let view =
            upload(device, queue, "image", size, TextureFormat::Rgba32Float, bytemuck::cast_slice(&texels));
        self.textures.insert(key, (Arc::clone(image), view.clone(), self.clock));
        view
    }
}

fn upload(
    device: &Device,
    queue: &Queue,
    label: &str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    bytes: &[u8],
) -> TextureView {
    let descriptor = TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    device
        .create_texture_with_data(queue, &descriptor, TextureDataOrder::LayerMajor, bytes)
        .create_view(&TextureViewDescriptor::default())
}

impl CallbackTrait for Pane {
    fn prepare(
        &self,
        device: &Device,
        queue: &Queue,
        _: &ScreenDescriptor,
        _: &mut CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<CommandBuffer> {
        let Some(shared) = resources.get_mut::<Shared>() else { return Vec::new() };
        let Shown { kind, origin, span, exposure, operator, false_colour, scale } = self.shown;
        let (number, wipe) = match kind {
            Kind::Image => (0, 0.0),
            Kind::Error(ErrorKind::Signed) => (1, 0.0),
            Kind::Error(ErrorKind::Relative) => (2, 0.0),
            Kind::Error(ErrorKind::Flip) => (3, 0.0),
            Kind::Wipe(at) => (4, at),
        };
        let place = Operator::ALL.iter().position(|other| *other == operator);
        let block = Block {
            origin,
            span,
            step: [span[0] / self.pixels.x, span[1] / self.pixels.y],
            exposure: exposure.exp2(),
            scale,
            wipe,
            line: 1.0 / self.pixels.x,
            background: BACKGROUND,
            kind: number,
            operator: place.unwrap_or(0) as u32,
            false_colour: u32::from(false_colour),
            encoded: u32::from(shared.encoded),
            pad: 0,
        };
        let uniform = device.create_buffer_init(&BufferInitDescriptor {
            label: Some("look"),
            contents: bytemuck::bytes_of(&block),
            usage: BufferUsages::UNIFORM,
        });
        let views = [0, 1].map(|i| shared.view(device, queue, &self.images[i]));
        let entry = |binding, resource| BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&BindGroupDescriptor {
            label: Some("picture"),
            layout: &shared.layout,
            entries: &[
                entry(0, uniform.as_entire_binding()),
                entry(1, BindingResource::TextureView(&views[0])),
                entry(2, BindingResource::TextureView(&views[1])),
                entry(3, BindingResource::TextureView(&shared.ramps)),
            ],
        });
        shared.groups.insert(self.id, group);
        Vec::new()
    }

    fn paint(
        &self,
        _: egui::PaintCallbackInfo,
        pass: &mut RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(shared) = resources.get::<Shared>() else { return };
        let Some(group) = shared.groups.get(&self.id) else { return };
        pass.set_pipeline(&shared.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}
