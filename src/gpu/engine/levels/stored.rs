//! What passes over an atlas read of its texels, on the device.

use wgpu::{Buffer, BufferUsages};

use crate::Gpu;
use crate::atlas::{empty_near, packed};
use crate::samples::Atlas;
use crate::shader::atlas::buffers::Over;
use crate::shader::atlas::{Axis, TEXELS};

/// The texels of an atlas that the mesh covers, what they hold, and in which workgroups passes take them.
#[derive(Debug)]
pub struct StoredAtlas {
    /// Each covered texel's place, row by row, and its chart.
    pub texels: Buffer,
    /// What these hold, sixteen a record.
    pub records: Buffer,
    /// Tiles along u and along v, and empty texels that lookups read, each with the one that it shows; and how many workgroups
    /// these are.
    lists: [(Buffer, u32); 3],
    /// Workgroups of the covered texels.
    workgroups: u32,
}

impl StoredAtlas {
    /// Of an atlas, with its empty texels where lookups are `dilated`. Records may be written to.
    #[must_use]
    pub fn new(gpu: &Gpu, atlas: &Atlas, dilated: bool) -> Self {
        let places = || (0..atlas.covered()).map(|place| atlas.texel(place));
        let list = |places: Vec<u32>, each: u32| {
            let workgroups = (places.len() as u32).div_ceil(each);
            let places = if places.is_empty() { vec![0; 4] } else { places };
            (gpu.buffer("texels", bytemuck::cast_slice(&places), BufferUsages::STORAGE), workgroups)
        };
        let texels: Vec<[u32; 2]> = places()
            .enumerate()
            .map(|(place, [column, row])| [row * atlas.size() + column, atlas.chart(place)])
            .collect();
        let records = match bytemuck::cast_slice(atlas.rows().all()) {
            [] => &[0; 16],
            bytes => bytes,
        };
        let tiles = |axis| list(crate::atlas::tiles(places(), axis), 1);
        Self {
            workgroups: (texels.len() as u32).div_ceil(TEXELS),
            texels: gpu.buffer("covered texels", bytemuck::cast_slice(&texels), BufferUsages::STORAGE),
            records: gpu.buffer("texels' records", records, BufferUsages::STORAGE),
            lists: [
                tiles(Axis::U),
                tiles(Axis::V),
                list(if dilated { filled(atlas) } else { Vec::new() }, 2 * TEXELS),
            ],
        }
    }

    /// What a shader's threads take beside the covered texels, and how many workgroups they are.
    #[must_use]
    pub const fn list(&self, over: Over) -> (&Buffer, u32) {
        let [across, down, empty] = &self.lists;
        match over {
            Over::Texels => (&across.0, self.workgroups),
            Over::Tiles(Axis::U) => (&across.0, across.1),
            Over::Tiles(Axis::V) => (&down.0, down.1),
            Over::Empty => (&empty.0, empty.1),
        }
    }
}

/// Pairs of texels, packed: an empty one, and the one that it shows; itself where it takes the mean of its neighbours.
fn filled(atlas: &Atlas) -> Vec<u32> {
    let size = atlas.size();
    if let Some(copies) = atlas.dilation().copies() {
        let pair = |(texel, number): (u32, u32)| {
            [packed([texel % size, texel / size]), packed(atlas.texel(number as usize))]
        };
        return copies.into_iter().flat_map(pair).collect();
    }
    let covered: Vec<[u32; 2]> = (0..atlas.covered()).map(|place| atlas.texel(place)).collect();
    empty_near(&covered, size).into_iter().flat_map(|texel| [texel; 2]).collect()
}
