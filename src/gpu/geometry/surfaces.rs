//! What a tile of the image is drawn into: depth, and numbers of its samples.

use wgpu::{
    Color, CommandEncoder, Extent3d, LoadOp, Operations, RenderPass, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp, TextureDescriptor, TextureDimension,
    TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
};

use crate::device::Gpu;
use crate::error::{GpuError, Oversized};
use crate::targets::{DEPTH, Tile};

/// The formats of `targets` targets.
pub(super) fn formats(targets: usize) -> Vec<TextureFormat> {
    vec![TextureFormat::Rgba32Float; targets]
}

/// Depth and targets of a tile.
pub(super) struct Surfaces {
    pub(super) depth: TextureView,
    pub(super) targets: Vec<TextureView>,
}

impl Surfaces {
    /// For tiles as large as `tile`, of `axis` samples along a pixel's side.
    pub(super) fn new(gpu: &Gpu, tile: Tile, axis: u32, targets: usize) -> Result<Self, GpuError> {
        let limit = gpu.max_side();
        if axis > limit {
            return Err(GpuError::TextureSize {
                adapter: gpu.name().to_owned(),
                what: "samples of one pixel".to_owned(),
                width: axis as usize,
                height: axis as usize,
                limit,
                of: Oversized::Pixel,
            });
        }
        let texture = |label, format| {
            let texture = gpu.device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d {
                    width: axis * tile.width,
                    height: axis * tile.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&TextureViewDescriptor::default())
        };
        let made = Self {
            depth: texture("depth of samples", DEPTH),
            targets: formats(targets).into_iter().map(|format| texture("samples drawn", format)).collect(),
        };
        gpu.check()?;
        Ok(made)
    }

    /// A pass into the first `targets` targets, cleared.
    pub(super) fn begin<'e>(&self, encoder: &'e mut CommandEncoder, targets: usize) -> RenderPass<'e> {
        let ops = Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store };
        let attachment =
            |view| Some(RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops });
        let attachments: Vec<_> = self.targets.iter().take(targets).map(attachment).collect();
        encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("geometry"),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
                stencil_ops: None,
            }),
            ..RenderPassDescriptor::default()
        })
    }
}
