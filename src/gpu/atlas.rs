//! A plan's passes over the UV atlas: the levels that they leave, and the compute shaders that make them.
//!
//! - this module: the levels, and when they are made; `list`: which texels passes take; `pass`: one of them on the device
//!
//! Levels are made once and again when something has changed that they are made of: the pose, a light, a constant. They are
//! the same whatever camera looks.

mod list;
mod pass;

use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use wgpu::{CommandEncoder, CommandEncoderDescriptor, TextureFormat, TextureUsages, TextureView};

use self::list::Texels;
pub(crate) use self::list::{empty_near, packed, tiles};
use self::pass::AtlasPass;
use super::compute::compute_pass;
use super::constants::Values;
use super::device::Gpu;
use super::error::{GpuError, Oversized};
use super::readback::Copy;
use super::targets::{Tile, texture_for};
use super::timing::Timer;
use super::upload::{Bound, Content, Uploads};
use crate::scene::mesh::tile_outside_atlas;
use crate::scene::view::Camera;
use crate::shader::Plan;
use crate::shader::atlas::{Level, Pass};

/// What passes over the atlas are timed as.
pub(super) const ATLAS: &str = "atlas";

/// A quantity in x, y and z, the chart in w.
const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// What passes over the UV atlas take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AtlasTraffic {
    /// How many there are.
    pub passes: usize,
    /// Bytes of levels and of lists of texels that they read and write, each once a pass: what vertices, maps and lights
    /// take is not among them.
    pub bytes: u64,
}

/// Passes on the device.
pub(super) struct Atlas {
    levels: HashMap<String, TextureView>,
    passes: Vec<AtlasPass>,
    /// Whether the levels are not those of what is set.
    stale: AtomicBool,
    /// The constants that were set last, pass by pass.
    constants: Mutex<Vec<Vec<f32>>>,
    made: AtomicU64,
}

impl Atlas {
    /// The passes of a plan; `None` where it has none.
    ///
    /// # Errors
    /// When the atlas is too large, the mesh does not lie in it, or the device does not take a pass.
    pub(super) fn new(gpu: &Gpu, plan: &Plan, uploads: &mut Uploads) -> Result<Option<Self>, GpuError> {
        let Some(size) = plan.facts.atlas.filter(|_| !plan.passes.is_empty()) else { return Ok(None) };
        check(gpu, size, uploads)?;
        let uvs = uploads.content().scene.mesh.atlas_uvs();
        let texels = Texels::new(gpu, uvs, uploads.triangles().of_skin(), size)?;
        let mut atlas = Self {
            levels: HashMap::new(),
            passes: Vec::with_capacity(plan.passes.len()),
            stale: AtomicBool::new(true),
            constants: Mutex::default(),
            made: AtomicU64::new(0),
        };
        for pass in &plan.passes {
            atlas.push(gpu, (size, &texels), pass, uploads)?;
        }
        gpu.check()?;
        Ok(Some(atlas))
    }

    fn push(
        &mut self,
        gpu: &Gpu,
        (size, texels): (u32, &Texels),
        pass: &Pass,
        uploads: &mut Uploads,
    ) -> Result<(), GpuError> {
        let read = self.bound(&pass.plan.levels)?;
        let mut left = Vec::with_capacity(pass.leaves.len());
        for level in &pass.leaves {
            // What no pass writes, as it is empty, is 0 from the start.
            let view = texture_for(gpu, &level.name, [size, size], FORMAT, 1, TextureUsages::STORAGE_BINDING);
            self.levels.insert(level.name.clone(), view.clone());
            left.push(view);
        }
        self.passes.push(AtlasPass::new(gpu, pass, uploads, read, (texels, &left))?);
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
        let blocks: Vec<Vec<f32>> = self.passes.iter().map(|pass| pass.inputs.set(gpu, values)).collect();
        let mut last = self.constants.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if *last != blocks {
            *last = blocks;
            self.forget();
        }
    }

    /// Have the levels made anew: the mesh, or what shines on it, has moved.
    pub(super) fn forget(&self) {
        self.stale.store(true, Ordering::Relaxed);
    }

    /// What the passes take: how many there are, and the bytes that they read of levels and lists, and write, each once.
    pub(super) fn traffic(&self) -> AtlasTraffic {
        AtlasTraffic { passes: self.passes.len(), bytes: self.passes.iter().map(|pass| pass.bytes).sum() }
    }

    /// How often the levels were made.
    pub(super) fn made(&self) -> u64 {
        self.made.load(Ordering::Relaxed)
    }

    /// Run every pass, in order, where the levels are not there yet.
    pub(super) fn draw(&self, encoder: &mut CommandEncoder, timer: Option<&mut Timer>) {
        if !self.stale.swap(false, Ordering::Relaxed) {
            return;
        }
        self.made.fetch_add(1, Ordering::Relaxed);
        self.passes.iter().for_each(|pass| pass.pack(encoder));
        let mut run = compute_pass(encoder, ATLAS, timer);
        self.passes.iter().for_each(|pass| pass.run(&mut run));
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
    let camera = Camera::pinhole(glam::DMat4::IDENTITY, 1.0, [1, 1]);
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
    // What is not skin has texture coordinates for its own pictures.
    let uvs = uploads.content().scene.mesh.atlas_uvs();
    let skin = uploads.triangles().of_skin().as_flattened();
    let uvs: Vec<_> = skin.iter().filter_map(|&vertex| uvs.get(vertex as usize).copied()).collect();
    match tile_outside_atlas(&uvs) {
        Some([u, v]) => Err(GpuError::OutsideAtlas { u, v }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_that_no_pass_leaves_is_refused_by_its_name() {
        let atlas = Atlas {
            levels: HashMap::new(),
            passes: Vec::new(),
            stale: AtomicBool::new(true),
            constants: Mutex::default(),
            made: AtomicU64::new(0),
        };
        let error = atlas
            .bound(&[Level { name: "mist".to_owned(), kind: "vec3f" }])
            .err()
            .map(|error| error.to_string());
        assert!(error.is_some_and(|error| error.contains("the level mist of the UV atlas")));
        assert!(atlas.bound(&[]).is_ok_and(|bound| bound.is_empty()));
    }
}
