//! Samples to pixels.

use wgpu::{BindGroup, BindingResource, Buffer, BufferUsages, RenderPass};

use super::device::Gpu;
use super::filter::{Filter, Input};
use super::targets::{Planes, Targets, Tile};

/// The means over squares of n x n samples, into a tile of the image.
pub(super) struct Resolve {
    filter: Filter,
    origin: Buffer,
    bound: BindGroup,
    /// Those of radiance times haze.
    glow: Option<(Filter, BindGroup)>,
}

impl Resolve {
    /// From `samples` to the pixels of `targets`.
    pub(super) fn new(gpu: &Gpu, targets: &Targets, samples: &Planes) -> Self {
        let key = &targets.key;
        let (entry, inputs): (_, &[Input]) = if key.hazy {
            ("resolve_hazy", &[Input::Uniform, Input::Texels, Input::Texels])
        } else {
            ("resolve", &[Input::Uniform, Input::Texels])
        };
        let constants =
            [("n", f64::from(key.antialias.grid())), ("largest", f64::from(key.precision.largest()))];
        let wgsl = include_str!("wgsl/resolve.wgsl");
        let filter = Filter::new(gpu, (wgsl, entry), &constants, inputs, &key.formats());
        let origin = gpu.buffer("origin", &[0; 16], BufferUsages::UNIFORM);
        let views = || samples.views().map(BindingResource::TextureView);
        let bound = filter.bind(gpu, std::iter::once(origin.as_entire_binding()).chain(views()).collect());
        let glow = targets.glow.as_ref().map(|_| {
            let (inputs, formats) = ([Input::Uniform, Input::Texels], [key.precision.color()]);
            let filter = Filter::new(gpu, (wgsl, "resolve_glow"), &constants, &inputs, &formats);
            let inputs = std::iter::once(origin.as_entire_binding()).chain(views().take(1));
            let bound = filter.bind(gpu, inputs.collect());
            (filter, bound)
        });
        Self { filter, origin, bound, glow }
    }

    /// Set the tile that is resolved next.
    pub(super) fn set(&self, gpu: &Gpu, tile: Tile) {
        gpu.queue.write_buffer(&self.origin, 0, bytemuck::cast_slice(&[tile.x, tile.y, 0, 0]));
    }

    /// Draw the tile's pixels.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, tile: Tile) {
        pass.set_scissor_rect(tile.x, tile.y, tile.width, tile.height);
        self.filter.draw(pass, &self.bound);
    }

    /// Draw what blooms of the tile's pixels.
    pub(super) fn draw_glow(&self, pass: &mut RenderPass<'_>, tile: Tile) {
        pass.set_scissor_rect(tile.x, tile.y, tile.width, tile.height);
        if let Some((filter, bound)) = &self.glow {
            filter.draw(pass, bound);
        }
    }
}
