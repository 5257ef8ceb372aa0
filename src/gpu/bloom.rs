//! What follows the mesh's passes: what stands behind it, and the bloom that the haze drives (`render::backdrop`,
//! `render::bloom`).

use wgpu::util::{DeviceExt as _, TextureDataOrder};
use wgpu::{
    BindGroup, BindingResource, Buffer, BufferUsages, Extent3d, RenderPass, TexelCopyBufferLayout,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

use super::device::Gpu;
use super::filter::{Filter, Input};
use super::targets::{Targets, texture};
use crate::model::gain::Gain;
use crate::render::backdrop::Backdrop;
use crate::render::bloom::kernel;

/// The image in front of its backdrop, with its bloom.
pub(super) struct Finish {
    gain: Buffer,
    /// What blooms, blurred along rows; absent without a bloom.
    across: Option<Across>,
    last: (Filter, BindGroup),
    backdrop: Option<Textures>,
    /// The finished image; alpha is the coverage, 1 where something stands behind the mesh.
    pub(super) whole: TextureView,
}

/// The blur along rows.
struct Across {
    filter: Filter,
    bound: BindGroup,
    blurred: TextureView,
}

/// A backdrop's radiance and what of it blooms.
struct Textures {
    rgb: TextureView,
    glow: TextureView,
}

impl Finish {
    /// Over the pixels of `targets`; `sigma` is the bloom's, as a share of the image's height. None where the image
    /// neither blooms nor has anything behind it.
    pub(super) fn new(gpu: &Gpu, targets: &Targets, sigma: f64, backdrop: Option<&Backdrop>) -> Option<Self> {
        let key = &targets.key;
        if !key.blooms && backdrop.is_none() {
            return None;
        }
        let format = key.precision.color();
        let flag = f64::from;
        let constants = [
            ("largest", f64::from(key.precision.largest())),
            ("hazy", flag(u8::from(key.hazy))),
            ("averaged", flag(u8::from(targets.glow.is_some()))),
            ("opaque", flag(u8::from(backdrop.is_some()))),
        ];
        let filter = |entry: &str, textures: usize| {
            let mut inputs = vec![Input::Uniform];
            inputs.resize(1 + textures, Input::Texels);
            Filter::new(gpu, (include_str!("wgsl/bloom.wgsl"), entry), &constants, &inputs, &[format])
        };
        let image = |label| texture(gpu, label, key.width, key.height, format, 1);
        let gain = gpu.buffer("gain", &[0; 16], BufferUsages::UNIFORM);
        let weights = kernel_texture(gpu, &kernel(key.height as usize, sigma));
        let black = floats(gpu, "black", 1, 1);
        let textures = backdrop.map(|_| Textures {
            rgb: floats(gpu, "backdrop", key.width, key.height),
            glow: floats(gpu, "backdrop's glow", key.width, key.height),
        });
        let (behind, behind_glow) = textures.as_ref().map_or((&black, &black), |t| (&t.rgb, &t.glow));
        let color = &targets.pixels.color;
        let coverage = targets.pixels.coverage.as_ref().unwrap_or(color);
        let glow = targets.glow.as_ref().unwrap_or(color);
        let read = [&weights, color, coverage, glow, behind, behind_glow];
        let bind = |filter: &Filter, textures: &[&TextureView]| {
            let textures = textures.iter().map(|view| BindingResource::TextureView(view));
            filter.bind(gpu, std::iter::once(gain.as_entire_binding()).chain(textures).collect())
        };
        let across = key.blooms.then(|| {
            let filter = filter("bloom_across", 6);
            let bound = bind(&filter, &read);
            Across { filter, bound, blurred: image("blurred") }
        });
        let last = match &across {
            Some(across) => {
                let filter = filter("bloom_down", 7);
                let bound = bind(&filter, &[&read[..], &[&across.blurred]].concat());
                (filter, bound)
            }
            None => {
                let filter = filter("in_front", 6);
                let bound = bind(&filter, &read);
                (filter, bound)
            }
        };
        let finish = Self { gain, across, last, backdrop: textures, whole: image("whole") };
        if let Some(backdrop) = backdrop {
            finish.set_backdrop(gpu, backdrop);
        }
        Some(finish)
    }

    /// Put another backdrop of the same size behind the mesh.
    pub(super) fn set_backdrop(&self, gpu: &Gpu, backdrop: &Backdrop) {
        let Some(textures) = &self.backdrop else { return };
        for (view, rgb) in [(&textures.rgb, &backdrop.rgb), (&textures.glow, &backdrop.glow)] {
            // Without a bloom there is no glow: its texture stays black.
            if rgb.is_empty() {
                continue;
            }
            let texels: Vec<[f32; 4]> = rgb.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
            let texture = view.texture();
            let (width, height) = (texture.width(), texture.height());
            let layout = TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(16 * width),
                rows_per_image: Some(height),
            };
            let size = Extent3d { width, height, depth_or_array_layers: 1 };
            gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, size);
        }
    }

    /// Set the factors on the image's radiance.
    pub(super) fn set(&self, gpu: &Gpu, gain: Gain) {
        gpu.queue.write_buffer(&self.gain, 0, bytemuck::cast_slice(&gain.channels().map(|x| x as f32)));
    }

    /// What the blur along rows is drawn into; none without a bloom.
    pub(super) fn blurred(&self) -> Option<&TextureView> {
        self.across.as_ref().map(|across| &across.blurred)
    }

    pub(super) fn draw_across(&self, pass: &mut RenderPass<'_>) {
        if let Some(across) = &self.across {
            across.filter.draw(pass, &across.bound);
        }
    }

    pub(super) fn draw_last(&self, pass: &mut RenderPass<'_>) {
        self.last.0.draw(pass, &self.last.1);
    }
}

/// A texture of 32-bit RGBA, black.
fn floats(gpu: &Gpu, label: &str, width: u32, height: u32) -> TextureView {
    texture(gpu, label, width, height, TextureFormat::Rgba32Float, 1)
}

/// The blur's weights, in one row.
fn kernel_texture(gpu: &Gpu, weights: &[f32]) -> TextureView {
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
    let (order, bytes) = (TextureDataOrder::LayerMajor, bytemuck::cast_slice(weights));
    let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytes);
    texture.create_view(&TextureViewDescriptor::default())
}
