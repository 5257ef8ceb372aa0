//! The bloom that the haze drives: `render::bloom` in two passes.

use wgpu::util::{DeviceExt as _, TextureDataOrder};
use wgpu::{
    BindGroup, BindingResource, Buffer, BufferUsages, Extent3d, RenderPass, TextureDescriptor,
    TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

use super::device::Gpu;
use super::filter::{Filter, Input};
use super::targets::{Targets, texture};
use crate::render::bloom::kernel;

/// Blur along rows, then along columns and onto the image.
pub(super) struct Bloom {
    gain: Buffer,
    across: (Filter, BindGroup),
    down: (Filter, BindGroup),
    /// Haze-weighted colour, blurred along rows.
    pub(super) blurred: TextureView,
    /// The image with its bloom, alpha being the coverage.
    pub(super) whole: TextureView,
}

impl Bloom {
    /// Over the pixels of `targets`.
    pub(super) fn new(gpu: &Gpu, targets: &Targets, coverage: &TextureView) -> Self {
        let key = &targets.key;
        let format = key.precision.color();
        let wgsl = include_str!("wgsl/bloom.wgsl");
        let filter = |entry: &str| {
            let inputs = [Input::Uniform, Input::Texels, Input::Texels, Input::Texels, Input::Texels];
            let count = if entry == "bloom_down" { 5 } else { 3 };
            let largest = [("largest", f64::from(key.precision.largest()))];
            Filter::new(gpu, (wgsl, entry), &largest, &inputs[..count], &[format])
        };
        let (across, down) = (filter("bloom_across"), filter("bloom_down"));
        let gain = gpu.buffer("gain", &[0; 16], BufferUsages::UNIFORM);
        let weights = kernel_texture(gpu, key.height);
        let image = |label| texture(gpu, label, key.width, key.height, format, 1);
        let (blurred, whole) = (image("blurred"), image("whole"));
        let view = BindingResource::TextureView;
        let color = &targets.pixels.color;
        let first = vec![gain.as_entire_binding(), view(&weights), view(color)];
        let mut second = first.clone();
        second.extend([view(coverage), view(&blurred)]);
        let (first, second) = (across.bind(gpu, first), down.bind(gpu, second));
        Self { gain, across: (across, first), down: (down, second), blurred, whole }
    }

    /// Set the factor on the image's radiance and haze.
    pub(super) fn set(&self, gpu: &Gpu, gain: f64) {
        gpu.queue.write_buffer(&self.gain, 0, bytemuck::cast_slice(&[gain as f32, 0.0, 0.0, 0.0]));
    }

    pub(super) fn draw_across(&self, pass: &mut RenderPass<'_>) {
        self.across.0.draw(pass, &self.across.1);
    }

    pub(super) fn draw_down(&self, pass: &mut RenderPass<'_>) {
        self.down.0.draw(pass, &self.down.1);
    }
}

/// The blur's weights for an image of `height` pixels, in one row.
fn kernel_texture(gpu: &Gpu, height: u32) -> TextureView {
    let weights = kernel(height as usize);
    let descriptor = TextureDescriptor {
        label: Some("kernel"),
        size: Extent3d { width: weights.len() as u32, height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::R32Float,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let (order, bytes) = (TextureDataOrder::LayerMajor, bytemuck::cast_slice(&weights));
    let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytes);
    texture.create_view(&TextureViewDescriptor::default())
}
