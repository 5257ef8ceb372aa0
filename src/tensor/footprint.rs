//! The linear maps of a scene: how texels become samples, and padded cubes.

use glam::Vec2;

use super::sparse::Entries;
use crate::model::cube::{Sources, padding};
use crate::samples::Hit;
use crate::scene::maps::corners;

/// From the texels of a cube, `(face * size + row) * size + column`, to those with a border of one texel from the
/// neighbouring faces, as lookups read them: rows 6 (size + 2)^2, columns 6 size^2.
#[must_use]
pub fn cube_border(size: usize) -> Entries {
    let mut entries = Entries::new(6 * size * size);
    for sources in padding(size) {
        match sources {
            Sources::One(texel) => entries.push_row([(texel as u32, 1.0)]),
            Sources::Corner(three) => entries.push_row(three.map(|texel| (texel as u32, 1.0 / 3.0))),
        }
    }
    entries
}

/// From the texels of a map, `row * width + column`, to its bilinear values at texture coordinates, as
/// [`Map::sample`](crate::scene::maps::Map::sample) takes them.
#[must_use]
pub fn texels(width: usize, height: usize, uvs: impl IntoIterator<Item = Vec2>) -> Entries {
    let mut entries = Entries::new(width * height);
    for uv in uvs {
        let (four, [x, y]) = corners(width, height, uv.x, uv.y);
        let weights = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
        entries.push_row(four.map(|texel| texel as u32).into_iter().zip(weights));
    }
    entries
}

/// From numbers of each vertex to those interpolated at points of the mesh.
#[must_use]
pub fn vertices<'h>(
    count: usize,
    triangles: &[[u32; 3]],
    hits: impl IntoIterator<Item = &'h Hit>,
) -> Entries {
    let mut entries = Entries::new(count);
    for hit in hits {
        entries.push_row(triangles[hit.triangle as usize].into_iter().zip(hit.weights()));
    }
    entries
}

/// The difference of each pair of neighbours, a row a pair.
#[must_use]
pub fn differences(count: usize, pairs: impl IntoIterator<Item = [u32; 2]>) -> Entries {
    let mut entries = Entries::new(count);
    for [a, b] in pairs {
        entries.push_row([(a, 1.0), (b, -1.0)]);
    }
    entries
}

/// Neighbouring texels of a map, to the right and below.
#[must_use]
pub fn texel_pairs(width: usize, height: usize) -> Vec<[u32; 2]> {
    let texel = |x: usize, y: usize| (y * width + x) as u32;
    let across = (0..height).flat_map(|y| (1..width).map(move |x| [texel(x - 1, y), texel(x, y)]));
    let down = (1..height).flat_map(|y| (0..width).map(move |x| [texel(x, y - 1), texel(x, y)]));
    across.chain(down).collect()
}

/// Vertices that an edge joins, each pair once.
#[must_use]
pub fn edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut pairs: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Neighbouring texels of a cube, across the edges of its faces too, each pair once.
#[must_use]
pub fn cube_pairs(size: usize) -> Vec<[u32; 2]> {
    let side = size + 2;
    let sources: Vec<Sources> = padding(size).collect();
    let at = |face: usize, row: usize, column: usize| match sources[(face * side + row) * side + column] {
        Sources::One(texel) => Some(texel as u32),
        Sources::Corner(_) => None,
    };
    let mut pairs = Vec::new();
    for face in 0..6 {
        for row in 1..=size {
            for column in 1..=size {
                let here = at(face, row, column);
                let near = [
                    at(face, row, column + 1),
                    at(face, row + 1, column),
                    at(face, row, column - 1),
                    at(face, row - 1, column),
                ];
                pairs.extend(near.into_iter().filter_map(|near| Some([here?.min(near?), here?.max(near?)])));
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
