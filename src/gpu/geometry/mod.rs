//! The geometry pass: what is stored of each sample of a view, drawn instead of shaded.
//!
//! - [`Geometry`]: a scene's mesh and maps on the device, and the passes over them
//! - `draw`: the text of its shaders
//! - `surfaces`: what a tile of the image is drawn into
//! - `compute`: the two compute shaders behind the rasteriser: `Coverage` packs a bit a sample, `Gather` takes what
//!   was drawn to records of sixteen pixels ([`crate::samples`])
//!
//! Samples lie where the CPU's rays go through the image: an image of n x n fragments a pixel has its fragments'
//! centres there. So a tile's first pass draws depth alone, and tells which samples show the mesh; the CPU groups
//! them; and further passes draw the numbers, of which each shader takes its sample's to its slot. No sample passes
//! through the host.

mod compute;
mod draw;
mod surfaces;

use std::ops::Range;

use rayon::prelude::*;
use wgpu::{Buffer, BufferUsages, CommandEncoder, CommandEncoderDescriptor};

use self::compute::{Coverage, Gather};
use self::draw::{ELSEWHERE, draws};
pub(crate) use self::draw::{outline, raster};
use self::surfaces::Surfaces;
use super::constants::Values;
use super::device::Gpu;
use super::error::GpuError;
use super::program::Program;
use super::targets::{Tile, tile_sides, tiles};
use super::upload::{Content, Uploads};
use crate::samples::covered::{Covered, SampleMask};
use crate::samples::surface_records::Places;
use crate::scene::view::Camera;
use crate::shader::Budget;

/// The most samples of a tile: 36 bytes each are 300 MB.
const MOST_SAMPLES: u64 = 1 << 23;

/// A scene on a device, ready for its samples to be drawn.
pub(crate) struct Geometry {
    gpu: Gpu,
    uploads: Uploads,
    /// Of the morph targets that are on the device.
    morph_weights: Vec<f32>,
    outline: Program,
    coverage: Coverage,
    draws: Vec<(Program, Gather)>,
}

/// Records of a view that are to be filled.
pub(crate) struct Wanted {
    /// The groups whose records they are.
    pub(crate) groups: Range<usize>,
    /// Where they go: a storage buffer.
    pub(crate) records: Buffer,
}

impl Geometry {
    /// The scene's mesh and maps, and the shaders that leave `places` in records of `rows` rows.
    pub(crate) fn new(gpu: &Gpu, content: Content, places: &Places, rows: usize) -> Result<Self, GpuError> {
        let morphs = &content.scene.mesh.morphs;
        let targets: Vec<usize> = (0..morphs.len()).filter(|&i| morphs[i].weight != 0.0).collect();
        let morph_weights = targets.iter().map(|&i| morphs[i].weight).collect();
        let facts = content.scene.facts(&content.params, Budget::Exact, false);
        let mut uploads = if places.corner_shares.is_some() {
            Uploads::by_corner(gpu, content, targets)?
        } else {
            Uploads::new(gpu, content, targets)?
        };
        let unplanned = |error: crate::shader::PlanError| GpuError::Plan(error.to_string());
        let alone = outline(&facts).map_err(unplanned)?;
        let alone = Program::new(gpu, alone, &mut uploads, &[], 1)?;
        let planned = draws(&facts, places).map_err(unplanned)?;
        let mut draws = Vec::with_capacity(planned.len());
        for (i, draw) in planned.into_iter().enumerate() {
            // One of the draws brings the samples' shares.
            let gather =
                Gather::new(gpu, &draw.gather(rows, places.weight.filter(|_| i == 0)), draw.targets());
            let formats = surfaces::formats(draw.targets());
            draws.push((Program::new(gpu, draw.plan, &mut uploads, &formats, 1)?, gather));
        }
        let coverage = Coverage::new(gpu);
        gpu.check()?;
        Ok(Self { gpu: gpu.clone(), uploads, morph_weights, outline: alone, coverage, draws })
    }

    /// What it is a scene of.
    pub(crate) const fn content(&self) -> &Content {
        self.uploads.content()
    }

    /// Which samples of `camera`'s image show the mesh, `axis` along a pixel's side.
    pub(crate) fn cover(&self, camera: &Camera, axis: u32) -> Result<SampleMask, GpuError> {
        let mut mask = SampleMask::new(axis * camera.width, axis * camera.height);
        let tiles = self.tiles(camera, axis);
        let surfaces = Surfaces::new(&self.gpu, tiles[0], axis, 0)?;
        for tile in tiles {
            let mut encoder = self.encoder();
            self.draw(&mut encoder, &self.outline, &surfaces, camera, tile, axis);
            let size = [axis * tile.width, axis * tile.height];
            let words = self.coverage.read(&self.gpu, encoder, &surfaces, size)?;
            mask.set_rectangle(axis * tile.x, axis * tile.y, size[0].div_ceil(u32::BITS) as usize, &words);
        }
        Ok(mask)
    }

    /// Fill records of what `camera` sees.
    pub(crate) fn fill(&self, camera: &Camera, covered: &Covered, wanted: &[Wanted]) -> Result<(), GpuError> {
        let axis = covered.axis();
        let tiles = self.tiles(camera, axis);
        let targets = self.draws.iter().map(|(_, gather)| gather.targets()).max().unwrap_or_default();
        let surfaces = Surfaces::new(&self.gpu, tiles[0], axis, targets)?;
        for tile in tiles {
            let parts = wanted.iter().filter_map(|wanted| {
                let sources = sources(covered, &wanted.groups, tile);
                let bytes = bytemuck::cast_slice(&sources);
                let upload = || self.gpu.buffer("sources", bytes, BufferUsages::STORAGE);
                (!sources.is_empty()).then(|| (upload(), &wanted.records))
            });
            let parts: Vec<(Buffer, &Buffer)> = parts.collect();
            for (program, gather) in &self.draws {
                let mut encoder = self.encoder();
                self.draw(&mut encoder, program, &surfaces, camera, tile, axis);
                for (sources, records) in &parts {
                    gather.encode(&self.gpu, &mut encoder, &surfaces, axis * tile.width, sources, records);
                }
                self.gpu.queue.submit([encoder.finish()]);
            }
            // Before the next tile's sources take more memory.
            self.gpu.wait()?;
        }
        self.gpu.check()
    }

    fn tiles(&self, camera: &Camera, axis: u32) -> Vec<Tile> {
        let sides = tile_sides(camera.width, camera.height, axis, self.gpu.max_side(), MOST_SAMPLES);
        tiles(camera.width, camera.height, sides)
    }

    fn encoder(&self) -> CommandEncoder {
        self.gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("geometry") })
    }

    fn draw(
        &self,
        encoder: &mut CommandEncoder,
        program: &Program,
        surfaces: &Surfaces,
        camera: &Camera,
        tile: Tile,
        axis: u32,
    ) {
        let (params, morph_weights) = (&self.uploads.content().params, self.morph_weights.as_slice());
        program.set(&self.gpu, &Values { params, camera, tile, morph_weights });
        let mut pass = surfaces.begin(encoder, program.targets());
        pass.set_viewport(0.0, 0.0, (axis * tile.width) as f32, (axis * tile.height) as f32, 0.0, 1.0);
        program.draw(&mut pass);
    }
}

/// For each slot of the groups, the texel of `tile` that its sample is, and the bits of its share; empty where none
/// of them is in the tile.
fn sources(covered: &Covered, groups: &Range<usize>, tile: Tile) -> Vec<[u32; 2]> {
    let axis = covered.axis();
    let (left, top) = (axis * tile.x, axis * tile.y);
    let (width, height) = (axis * tile.width, axis * tile.height);
    let of_group = |group: usize| {
        covered.sources(group).map(move |source| {
            let (x, y) = (source.x.wrapping_sub(left), source.y.wrapping_sub(top));
            let texel = if x < width && y < height { y * width + x } else { ELSEWHERE };
            [texel, source.share.to_bits()]
        })
    };
    let sources: Vec<[u32; 2]> = groups.clone().into_par_iter().flat_map_iter(of_group).collect();
    let none = sources.par_iter().all(|source| source[0] == ELSEWHERE);
    if none { Vec::new() } else { sources }
}
