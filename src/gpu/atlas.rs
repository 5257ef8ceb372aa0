//! A plan's passes over the UV atlas: the levels that they leave, and the programs that draw them.

use std::collections::HashMap;

use wgpu::{
    Color, CommandEncoder, CommandEncoderDescriptor, LoadOp, Operations, RenderPassColorAttachment,
    RenderPassDescriptor, StoreOp, TextureFormat, TextureView,
};

use super::constants::Values;
use super::device::Gpu;
use super::error::{GpuError, Oversized};
use super::pipeline::{Outputs, Pipeline};
use super::readback::Copy;
use super::targets::{Tile, texture};
use super::timing::Timer;
use super::upload::{Bound, Content, Uploads};
use crate::samples::atlas::overlap;
use crate::scene::mesh::{Mesh, tile_outside_atlas};
use crate::scene::view::Camera;
use crate::shader::Plan;
use crate::shader::atlas::{Level, Pass};

/// A quantity in x, y and z, the chart in w.
const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// Passes on the device.
pub(super) struct Atlas {
    levels: HashMap<String, TextureView>,
    /// Each with the levels that it leaves.
    passes: Vec<(Pipeline, Vec<TextureView>)>,
}

impl Atlas {
    /// The passes of a plan; `None` where it has none.
    ///
    /// # Errors
    /// When the atlas is too large, the mesh does not lie in it, or the device does not take a pass.
    pub(super) fn new(gpu: &Gpu, plan: &Plan, uploads: &mut Uploads) -> Result<Option<Self>, GpuError> {
        let Some(size) = plan.facts.atlas.filter(|_| !plan.passes.is_empty()) else { return Ok(None) };
        check(gpu, size, uploads)?;
        let mut atlas = Self { levels: HashMap::new(), passes: Vec::with_capacity(plan.passes.len()) };
        for pass in &plan.passes {
            atlas.push(gpu, size, pass, uploads)?;
        }
        Ok(Some(atlas))
    }

    fn push(&mut self, gpu: &Gpu, size: u32, pass: &Pass, uploads: &mut Uploads) -> Result<(), GpuError> {
        let mut left = Vec::with_capacity(pass.leaves.len());
        for level in &pass.leaves {
            let view = texture(gpu, &level.name, size, size, FORMAT, 1);
            self.levels.insert(level.name.clone(), view.clone());
            left.push(view);
        }
        let formats = vec![FORMAT; left.len()];
        let outputs = Outputs { formats: &formats, multisamples: 1, depth: false };
        let read = self.bound(&pass.plan.levels)?;
        self.passes.push((Pipeline::new(gpu, pass.plan.clone(), uploads, read, outputs)?, left));
        Ok(())
    }

    /// Levels, ready to be bound.
    ///
    /// # Errors
    /// When no pass before has left one of them.
    pub(super) fn bound(&self, levels: &[Level]) -> Result<Vec<Bound>, GpuError> {
        let bound = |level: &Level| match self.levels.get(&level.name) {
            Some(view) => Ok(Bound::Texture(view.clone())),
            None => Err(GpuError::MissingLevel { level: level.name.clone() }),
        };
        levels.iter().map(bound).collect()
    }

    /// Set the constants of what is drawn next.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>) {
        self.passes.iter().for_each(|(program, _)| program.inputs.set(gpu, values));
    }

    /// Draw every pass, in order.
    pub(super) fn draw(&self, encoder: &mut CommandEncoder, mut timer: Option<&mut Timer>) {
        for (program, left) in &self.passes {
            let ops = Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store };
            let attachment =
                |view| Some(RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops });
            let attachments: Vec<_> = left.iter().map(attachment).collect();
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("atlas"),
                color_attachments: &attachments,
                timestamp_writes: timer.as_mut().and_then(|timer| timer.around("atlas")),
                ..RenderPassDescriptor::default()
            });
            program.draw(&mut pass);
        }
    }
}

/// The levels that a plan's passes leave of `content`, by name: four numbers a texel, row by row. Active morph targets
/// are summed.
///
/// # Errors
/// When the atlas is too large, the mesh does not lie in it, or the device fails.
pub fn levels(gpu: &Gpu, plan: &Plan, content: Content) -> Result<HashMap<String, Vec<f32>>, GpuError> {
    let morphs = &content.scene.mesh.morphs;
    let targets: Vec<usize> = (0..morphs.len()).filter(|&i| morphs[i].weight != 0.0).collect();
    let morph_weights: Vec<f32> = targets.iter().map(|&i| morphs[i].weight).collect();
    let mut uploads = Uploads::new(gpu, content, targets)?;
    let Some(atlas) = Atlas::new(gpu, plan, &mut uploads)? else { return Ok(HashMap::new()) };
    // Nobody sees a texel: any camera does.
    let camera = Camera { world_to_camera: glam::DMat4::IDENTITY, fov_y: 1.0, width: 1, height: 1 };
    let tile = Tile { x: 0, y: 0, width: 1, height: 1 };
    let params = &uploads.content().params;
    atlas.set(gpu, &Values { params, camera: &camera, tile, morph_weights: &morph_weights });
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("atlas") });
    uploads.draw_shadow_maps(gpu, &mut encoder, &morph_weights, None);
    atlas.draw(&mut encoder, None);
    let copies: Vec<(String, Copy)> =
        atlas.levels.iter().map(|(name, view)| (name.clone(), Copy::new(gpu, &mut encoder, view))).collect();
    gpu.queue.submit([encoder.finish()]);
    gpu.check()?;
    copies.into_iter().map(|(name, copy)| Ok((name, copy.read(gpu)?))).collect()
}

/// Whether the adapter takes an atlas of that size, and the mesh lies in it.
fn check(gpu: &Gpu, size: u32, uploads: &Uploads) -> Result<(), GpuError> {
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if size > limit {
        let (adapter, what, side) = (gpu.name().to_owned(), "UV atlas".to_owned(), size as usize);
        let of = Oversized::Map;
        return Err(GpuError::TextureSize { adapter, what, width: side, height: side, limit, of });
    }
    let Mesh { uvs, triangles, .. } = &uploads.content().scene.mesh;
    if let Some([u, v]) = tile_outside_atlas(uvs) {
        return Err(GpuError::OutsideAtlas { u, v });
    }
    overlap(uvs, triangles, size).map_err(|error| GpuError::Plan(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_that_no_pass_leaves_is_refused_by_its_name() {
        let atlas = Atlas { levels: HashMap::new(), passes: Vec::new() };
        let error = atlas
            .bound(&[Level { name: "mist".to_owned(), kind: "vec3f" }])
            .err()
            .map(|error| error.to_string());
        assert!(error.is_some_and(|error| error.contains("the level mist of the UV atlas")));
        assert!(atlas.bound(&[]).is_ok_and(|bound| bound.is_empty()));
    }
}
