//! Which texels passes take: lists that are made once, as texture coordinates never move.

use std::collections::BTreeSet;

use glam::Vec2;
use wgpu::{Buffer, BufferUsages};

use crate::samples::atlas::{Listed, listed};
use crate::shader::atlas::{Axis, TEXELS, TILE};
use crate::{Gpu, GpuError};

/// Texels that a pass takes, and how many workgroups.
#[derive(Clone)]
pub(super) struct List {
    pub(super) buffer: Buffer,
    pub(super) workgroups: u32,
}

/// The texels of an atlas.
pub(super) struct Texels {
    /// How many the mesh covers.
    pub(super) count: u64,
    /// These: their places, triangles and shares.
    pub(super) covered: List,
    /// Those, and two rings of empty ones around them: their places.
    pub(super) filled: List,
    /// The first texels of the tiles along u, and along v, that hold a covered one.
    tiles: [List; 2],
}

impl Texels {
    /// Of a mesh that is laid out by these texture coordinates.
    ///
    /// # Errors
    /// When light cannot stand in such an atlas, or the adapter takes no list as long.
    pub(super) fn new(gpu: &Gpu, uvs: &[Vec2], triangles: &[[u32; 3]], size: u32) -> Result<Self, GpuError> {
        let covered = listed(uvs, triangles, size).map_err(|error| GpuError::Plan(error.to_string()))?;
        let words = |texel: &Listed| {
            let [b, c] = texel.shares.map(f32::to_bits);
            [packed(texel.texel), texel.triangle, b, c]
        };
        let list = |words: &[[u32; 4]]| -> Result<List, GpuError> {
            let workgroups = (words.len() as u32).div_ceil(TEXELS);
            Ok(List { buffer: buffer(gpu, bytemuck::cast_slice(words))?, workgroups })
        };
        let tiles = |axis| -> Result<List, GpuError> {
            let tiles = tiles(covered.iter().map(|texel| texel.texel), axis);
            Ok(List { buffer: buffer(gpu, bytemuck::cast_slice(&tiles))?, workgroups: tiles.len() as u32 })
        };
        let places: Vec<[u32; 2]> = covered.iter().map(|texel| texel.texel).collect();
        let filled: Vec<[u32; 4]> = filled(&places, size).into_iter().map(|place| [place, 0, 0, 0]).collect();
        Ok(Self {
            count: covered.len() as u64,
            covered: list(&covered.iter().map(words).collect::<Vec<_>>())?,
            filled: list(&filled)?,
            tiles: [tiles(Axis::U)?, tiles(Axis::V)?],
        })
    }

    pub(super) const fn tiles(&self, axis: Axis) -> &List {
        match axis {
            Axis::U => &self.tiles[0],
            Axis::V => &self.tiles[1],
        }
    }
}

/// A buffer of a list; of one that is empty there are no workgroups.
fn buffer(gpu: &Gpu, contents: &[u8]) -> Result<Buffer, GpuError> {
    gpu.check_binding("texels of the UV atlas", contents.len() as u64)?;
    Ok(gpu.buffer("texels", if contents.is_empty() { &[0; 16] } else { contents }, BufferUsages::STORAGE))
}

/// Column in the low half, row in the high one: textures have fewer than 2^16 texels a side.
pub(crate) const fn packed([column, row]: [u32; 2]) -> u32 {
    row << 16 | column
}

/// The first texel of each tile that holds a covered one, packed.
pub(crate) fn tiles(covered: impl Iterator<Item = [u32; 2]>, axis: Axis) -> Vec<u32> {
    let [along, across] = TILE;
    let sides = match axis {
        Axis::U => [along, across],
        Axis::V => [across, along],
    };
    let tile = |texel: [u32; 2]| packed([0, 1].map(|k| texel[k] - texel[k] % sides[k]));
    covered.map(tile).collect::<BTreeSet<u32>>().into_iter().collect()
}

/// The covered texels, and those of the two rings around them, packed.
fn filled(covered: &[[u32; 2]], size: u32) -> BTreeSet<u32> {
    let near = |x: u32| x.saturating_sub(2)..(x + 3).min(size);
    let around = |&[column, row]: &[u32; 2]| {
        near(row).flat_map(move |row| near(column).map(move |column| packed([column, row])))
    };
    covered.iter().flat_map(around).collect()
}

/// The texels of these rings alone, packed.
pub(crate) fn empty_near(covered: &[[u32; 2]], size: u32) -> Vec<u32> {
    let own: BTreeSet<u32> = covered.iter().map(|&texel| packed(texel)).collect();
    filled(covered, size).difference(&own).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_each_covered_texel_and_none_is_empty() {
        let covered = [[0, 0], [63, 3], [64, 3], [70, 200]];
        assert_eq!(tiles(covered.into_iter(), Axis::U), [[0, 0], [64, 0], [64, 200]].map(packed));
        assert_eq!(tiles(covered.into_iter(), Axis::V), [[0, 0], [60, 0], [64, 0], [68, 192]].map(packed));
    }

    #[test]
    fn two_rings_around_covered_texels_are_filled_within_the_atlas() {
        assert_eq!(filled(&[[8, 8]], 16).len(), 25);
        let corner = filled(&[[0, 0], [1, 0]], 16);
        assert_eq!(corner.len(), 12);
        assert!(corner.contains(&packed([3, 2])) && !corner.contains(&packed([0, 3])));
        assert_eq!(empty_near(&[[0, 0], [1, 0]], 16).len(), 10);
    }
}
