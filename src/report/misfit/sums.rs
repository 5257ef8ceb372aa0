//! Sums of residuals over the pixels of a place, and the standard error of their mean, from blocks of pixels.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::ViewEvidence;

/// Blocks that are needed of a greater size than the smallest.
const BLOCKS: usize = 30;
/// Blocks without which there is no standard error.
const FEWEST_BLOCKS: usize = 5;
/// Side of the smallest blocks, in pixels.
const BLOCK: usize = 8;

/// The smallest blocks of pixels of all views: view, column and row of each.
pub(super) struct Blocks {
    keys: Vec<[usize; 3]>,
    /// The first block of each view.
    first: Vec<usize>,
}

impl Blocks {
    pub(super) fn of(views: &[ViewEvidence]) -> Self {
        let (mut keys, mut first) = (Vec::new(), Vec::new());
        for (index, view) in views.iter().enumerate() {
            first.push(keys.len());
            let [columns, rows] = [view.fit.width, view.fit.height].map(|side| side.div_ceil(BLOCK));
            keys.extend((0..rows).flat_map(|row| (0..columns).map(move |column| [index, column, row])));
        }
        Self { keys, first }
    }

    /// The block of a pixel.
    pub(super) fn at(&self, index: usize, view: &ViewEvidence, at: usize) -> usize {
        let width = view.fit.width;
        self.first[index] + at / width / BLOCK * width.div_ceil(BLOCK) + at % width / BLOCK
    }
}

/// Sums over the pixels of a place.
#[derive(Debug)]
pub(super) struct Sums {
    pub(super) pixels: f64,
    residual: f64,
    pub(super) target: f64,
    pub(super) squares: f64,
    /// Pixels and the sum of their residuals, by block.
    blocks: Vec<[f64; 2]>,
}

impl Sums {
    pub(super) fn over(blocks: &Blocks) -> Self {
        Self {
            pixels: 0.0,
            residual: 0.0,
            target: 0.0,
            squares: 0.0,
            blocks: vec![[0.0; 2]; blocks.keys.len()],
        }
    }

    pub(super) fn add(&mut self, channels: Range<usize>, block: usize, residual: [f64; 3], target: [f64; 3]) {
        let of = |rgb: [f64; 3]| rgb[channels.clone()].iter().sum::<f64>() / channels.len() as f64;
        let own = of(residual);
        self.pixels += 1.0;
        self.residual += own;
        self.target += of(target);
        self.squares += residual[channels.clone()].iter().map(|r| r * r).sum::<f64>();
        let [pixels, sum] = &mut self.blocks[block];
        (*pixels, *sum) = (*pixels + 1.0, *sum + own);
    }

    pub(super) fn mean(&self) -> f64 {
        self.residual / self.pixels
    }

    /// The standard error of the mean, from the sums over blocks.
    pub(super) fn std_error(&self, blocks: &Blocks) -> Option<f64> {
        let there = blocks.keys.iter().zip(&self.blocks).filter(|(_, [pixels, _])| *pixels > 0.0);
        let mut sums: BTreeMap<[usize; 3], [f64; 2]> = there.map(|(key, sums)| (*key, *sums)).collect();
        let (mean, mut greatest) = (self.mean(), None);
        while sums.len() >= if greatest.is_none() { FEWEST_BLOCKS } else { BLOCKS } {
            let count = sums.len() as f64;
            // A block's sum beside what the mean makes of its pixels.
            let squares: f64 = sums.values().map(|[pixels, sum]| (sum - mean * pixels).powi(2)).sum();
            let error = (count / (count - 1.0) * squares).sqrt() / self.pixels;
            greatest = Some(greatest.map_or(error, |before: f64| before.max(error)));
            let mut greater = BTreeMap::new();
            for ([view, column, row], [pixels, sum]) in &sums {
                let own: &mut [f64; 2] = greater.entry([*view, column / 2, row / 2]).or_default();
                *own = [own[0] + pixels, own[1] + sum];
            }
            // No two of one view are left.
            if greater.len() == sums.len() {
                break;
            }
            sums = greater;
        }
        greatest
    }
}
