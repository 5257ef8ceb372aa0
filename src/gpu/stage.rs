//! A stage of images: the targets of one size, and what is drawn into them.

use wgpu::{
    Color, CommandEncoder, LoadOp, Operations, RenderPassColorAttachment, RenderPassDepthStencilAttachment,
    RenderPassDescriptor, RenderPassTimestampWrites, RenderPipeline, StoreOp, TextureView,
};

use super::bloom::Finish;
use super::device::Gpu;
use super::pipeline::Pipeline;
use super::plain::Plain;
use super::program::{Program, Shaded};
use super::readback::Copy;
use super::resolve::Resolve;
use super::targets::{Planes, Targets, Tile};
use super::timing::Timer;
use crate::model::gain::Gain;
use crate::render::image::Image;

/// Targets, and the passes after the mesh's.
pub(super) struct Stage {
    pub(super) targets: Targets,
    pub(super) resolve: Option<Resolve>,
    pub(super) finish: Option<Finish>,
}

/// What is drawn into a stage.
pub(super) struct Drawn<'a> {
    pub(super) program: &'a Program<Shaded>,
    /// What is not skin, and what draws it.
    pub(super) plain: Option<(&'a Plain, &'a RenderPipeline)>,
}

/// How a frame ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// What the mesh's passes drew is read.
    Parts,
    /// What stands behind the mesh and the bloom are added, and it is read.
    Finished,
    /// They are added, and it stays on the adapter.
    Unread,
}

impl Stage {
    /// The image of a frame that is finished: the last passes have the gain in them already.
    pub(super) fn finished_image(&self, planes: &[Vec<f32>], gain: Gain) -> (Image, usize) {
        self.image(planes, if self.finish.is_some() { Gain::ONE } else { gain })
    }

    /// Draw the mesh into a tile, and its samples into the image.
    pub(super) fn encode_tile(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        shown: &Drawn<'_>,
        tile: Tile,
        first: bool,
        mut timer: Option<&mut Timer>,
    ) {
        if first {
            shown.program.prepare(encoder, timer.as_deref_mut());
        }
        let targets = &self.targets;
        let drawn = targets.samples.as_ref().unwrap_or(&targets.pixels);
        match &shown.program.pipelines {
            Shaded::Forward(pipeline) => {
                self.encode_raster(encoder, (pipeline, shown), drawn, tile, timer.as_deref_mut());
            }
            Shaded::Computed(buffer) => {
                buffer.encode(gpu, encoder, (targets, drawn), tile, timer.as_deref_mut());
            }
        }
        if let Some(resolve) = &self.resolve {
            resolve.set(gpu, tile);
            let attachments = attached(&targets.pixels, None, first);
            let times = timer.as_mut().and_then(|timer| timer.around("resolve"));
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("resolve"),
                color_attachments: &attachments,
                timestamp_writes: times,
                ..RenderPassDescriptor::default()
            });
            resolve.draw(&mut pass, tile);
        }
        if let (Some(resolve), Some(glow)) = (&self.resolve, &targets.glow) {
            let times = timer.as_mut().and_then(|timer| timer.around("resolve, glow"));
            let load = if first { LoadOp::Clear(Color::TRANSPARENT) } else { LoadOp::Load };
            over(encoder, glow, load, times, |pass| resolve.draw_glow(pass, tile));
        }
    }

    /// Draw the mesh into a tile's samples, shaded by the fragment stage.
    fn encode_raster(
        &self,
        encoder: &mut CommandEncoder,
        (pipeline, shown): (&Pipeline, &Drawn<'_>),
        drawn: &Planes,
        tile: Tile,
        mut timer: Option<&mut Timer>,
    ) {
        let targets = &self.targets;
        let attachments = match &targets.multisampled {
            Some(multisampled) => attached(multisampled, Some(drawn), true),
            None => attached(drawn, None, true),
        };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("raster"),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(cleared(&targets.depth)),
            timestamp_writes: timer.as_mut().and_then(|timer| timer.around("raster")),
            ..RenderPassDescriptor::default()
        });
        let n = targets.key.antialias.grid();
        let (width, height) = ((n * tile.width) as f32, (n * tile.height) as f32);
        pass.set_viewport(0.0, 0.0, width, height, 0.0, 1.0);
        pipeline.draw(&mut pass);
        if let Some((plain, pipeline)) = shown.plain {
            plain.draw(&mut pass, pipeline);
        }
    }

    /// After the last tile: what stands behind the mesh and the bloom, and copies of what the image is made of, as far as
    /// they are wanted.
    pub(super) fn encode_end(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        gain: Gain,
        end: End,
        timer: Option<&mut Timer>,
    ) -> Vec<Copy> {
        let whole = if end == End::Parts { None } else { self.encode_finish(gpu, encoder, gain, timer) };
        match whole {
            _ if end == End::Unread => Vec::new(),
            Some(whole) => vec![Copy::new(gpu, encoder, whole)],
            None => self.targets.pixels.views().map(|view| Copy::new(gpu, encoder, view)).collect(),
        }
    }

    /// What stands behind the mesh and the bloom, in the whole image; `None` where neither is.
    fn encode_finish(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        gain: Gain,
        mut timer: Option<&mut Timer>,
    ) -> Option<&TextureView> {
        let finish = self.finish.as_ref()?;
        finish.set(gpu, gain);
        let clear = LoadOp::Clear(Color::TRANSPARENT);
        if let Some(blurred) = finish.blurred() {
            let times = timer.as_mut().and_then(|timer| timer.around("bloom, rows"));
            over(encoder, blurred, clear, times, |pass| finish.draw_across(pass));
        }
        let last = if finish.blurred().is_some() { "bloom, columns" } else { "backdrop" };
        let times = timer.as_mut().and_then(|timer| timer.around(last));
        over(encoder, &finish.whole, clear, times, |pass| finish.draw_last(pass));
        Some(&finish.whole)
    }

    /// The image of those planes, and how many of its pixels reached the end of the targets' range.
    pub(super) fn image(&self, planes: &[Vec<f32>], gain: Gain) -> (Image, usize) {
        let gain = gain.0.map(|factor| factor as f32);
        let key = &self.targets.key;
        let largest = key.precision.largest();
        let mut image = Image::new(key.width as usize, key.height as usize);
        let mut clipped = 0;
        let texels = planes[0].chunks_exact(4);
        for (i, texel) in texels.enumerate() {
            let rgb = [texel[0], texel[1], texel[2]].map(|x| x.clamp(-largest, largest));
            clipped += usize::from(rgb.iter().any(|x| x.abs() >= largest));
            image.rgb[i] = [0, 1, 2].map(|c| gain[c] * rgb[c]);
            image.alpha[i] = planes.get(1).map_or(texel[3], |coverage| coverage[i]);
        }
        (image, clipped)
    }
}

/// Depth that nobody reads after the pass.
pub(super) fn cleared(view: &TextureView) -> RenderPassDepthStencilAttachment<'_> {
    let depth_ops = Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Discard });
    RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}

/// Planes as a pass's attachments, resolved into others where those are given.
fn attached<'a>(
    planes: &'a Planes,
    resolved: Option<&'a Planes>,
    clear: bool,
) -> Vec<Option<RenderPassColorAttachment<'a>>> {
    let mut resolved = resolved.map(Planes::views);
    let attachment = |view: &'a TextureView| {
        let resolve_target = resolved.as_mut().and_then(Iterator::next);
        let load = if clear { LoadOp::Clear(Color::TRANSPARENT) } else { LoadOp::Load };
        let store = if resolve_target.is_some() { StoreOp::Discard } else { StoreOp::Store };
        Some(RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops: Operations { load, store },
        })
    };
    planes.views().map(attachment).collect()
}

/// A pass over the whole of `view`.
fn over(
    encoder: &mut CommandEncoder,
    view: &TextureView,
    load: LoadOp<Color>,
    timestamp_writes: Option<RenderPassTimestampWrites<'_>>,
    draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
) {
    let ops = Operations { load, store: StoreOp::Store };
    let attachment = RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops };
    let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
        color_attachments: &[Some(attachment)],
        timestamp_writes,
        ..RenderPassDescriptor::default()
    });
    draw(&mut pass);
}
