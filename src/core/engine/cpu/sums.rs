//! What passes add up: the sums of a chunk of blocks, and of chunks in a fixed order.

use crate::engine::BLOCK;
use crate::samples::LANES;

/// Blocks in a chunk: one unit of work, and 64 terms a lane.
pub(super) const CHUNK: usize = 4;

/// Packed sums of a chunk: each channel's triangle (or its last column), then the loss.
pub(super) struct Sums(pub(super) Vec<f64>);

/// Sum in a fixed binary tree: as accurate as it is deterministic.
pub(super) fn pairwise(mut sums: Vec<Sums>) -> Sums {
    let mut width = sums.len();
    while width > 1 {
        let half = width.div_ceil(2);
        let (low, high) = sums.split_at_mut(half);
        for (a, b) in low.iter_mut().zip(&high[..width - half]) {
            for (x, y) in a.0.iter_mut().zip(&b.0) {
                *x += y;
            }
        }
        width = half;
    }
    sums.into_iter().next().unwrap_or(Sums(Vec::new()))
}

/// The sum of the lanes, as a tree: its halves are added side by side, and their order never changes. In loops: a chunk
/// of 4,096 pixels has some hundreds of these, and arrays that closures make are calls of their own.
#[inline(always)]
pub(super) fn fold(lanes: &[f32; LANES]) -> f64 {
    let mut sums = [0.0; LANES / 2];
    for i in 0..LANES / 2 {
        sums[i] = f64::from(lanes[i]) + f64::from(lanes[i + LANES / 2]);
    }
    let mut width = LANES / 2;
    while width > 1 {
        width /= 2;
        for i in 0..width {
            sums[i] += sums[i + width];
        }
    }
    sums[0]
}

/// Of each chunk the parts of all planes.
pub(super) fn by_chunk(planes: &mut [Vec<f32>]) -> Vec<Vec<&mut [f32]>> {
    let mut chunks: Vec<Vec<&mut [f32]>> = Vec::new();
    for plane in planes {
        let parts = plane.chunks_mut(BLOCK * CHUNK * LANES);
        chunks.resize_with(parts.len(), Vec::new);
        chunks.iter_mut().zip(parts).for_each(|(chunk, part)| chunk.push(part));
    }
    chunks
}
