//! The sums of a chunk of blocks, and of chunks in a fixed order.

use crate::engine::gram::{Columns, add_gram, add_last};
// What the scratch holds at once: it should stay in the nearest caches.
pub(super) use crate::engine::BLOCK;
use crate::engine::kernel::{Kernel, Rims};
use crate::engine::lanes::Lanes;
use crate::engine::plan::{ChannelPlan, Plan};
use crate::engine::window::{self, Window};
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::simd::Simd;

/// Blocks in a chunk: one unit of work, and 64 terms a lane.
pub(in crate::engine) const CHUNK: usize = 4;

/// What a pass yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::engine) enum Wish {
    Loss,
    Gradient,
    Normal,
}

/// The blocks of a chunk.
pub(super) struct Blocks<'a> {
    pub(super) blocks: &'a [usize],
    /// How many groups there are in all; the last block may be short of some.
    pub(super) groups: usize,
}

/// Packed sums of a chunk: each channel's triangle (or its last column), then the loss.
pub(in crate::engine) struct Sums(pub(in crate::engine) Vec<f64>);

/// Sum in a fixed binary tree: as accurate as it is deterministic.
pub(in crate::engine) fn pairwise(mut sums: Vec<Sums>) -> Sums {
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

pub(super) struct Scratch {
    windows: Vec<Window>,
    rims: Rims,
    sums: Vec<Row>,
}

impl Scratch {
    pub(super) fn new(plan: &Plan) -> Self {
        let pairs: usize = plan.channels.iter().map(ChannelPlan::pairs).sum();
        Self { windows: vec![window::EMPTY; BLOCK], rims: Rims::default(), sums: vec![Row::ZERO; pairs] }
    }
}

/// The sums over a few blocks.
#[inline(always)]
pub(super) fn chunk<S: Simd>(
    kernel: &Kernel<'_, S>,
    Blocks { blocks, groups }: Blocks<'_>,
    wish: Wish,
    scratch: &mut Scratch,
) -> Sums {
    let simd = kernel.simd;
    let Scratch { windows, rims, sums } = scratch;
    sums.fill(Row::ZERO);
    let mut loss = Lanes::splat(simd, 0.0);
    let mut used = 0;
    for &block in blocks {
        let first = block * BLOCK;
        let length = groups.min(first + BLOCK) - first;
        kernel.begin(first..first + length, rims);
        let windows = &mut windows[..length];
        for (group, window) in (first..).zip(windows.iter_mut()) {
            if wish == Wish::Loss {
                kernel.group::<false>(group, rims, window);
                loss = loss + kernel.weigh::<false>(group, window);
            } else {
                kernel.group::<true>(group, rims, window);
                loss = loss + kernel.weigh::<true>(group, window);
            }
        }
        used = 0;
        for channel in &kernel.plan.channels {
            let count = channel.columns + 1;
            let columns = Columns { windows, rows: &channel.rows };
            match wish {
                Wish::Loss => {}
                Wish::Gradient => {
                    add_last(simd, columns, &mut sums[used..]);
                    used += count;
                }
                Wish::Normal => {
                    add_gram(simd, columns, &mut sums[used..]);
                    used += channel.pairs();
                }
            }
        }
    }
    let mut folded: Vec<f64> = Vec::with_capacity(used + 1);
    for row in &sums[..used] {
        folded.push(fold(row));
    }
    folded.push(fold(&loss.to_array()));
    Sums(folded)
}

/// The sum of the lanes, as a tree: its halves are added side by side, and their order never changes.
#[inline(always)]
pub(in crate::engine) fn fold(lanes: &[f32; LANES]) -> f64 {
    let mut sums = lanes.map(f64::from);
    let mut width = LANES;
    while width > 1 {
        width /= 2;
        for i in 0..width {
            sums[i] += sums[i + width];
        }
    }
    sums[0]
}
