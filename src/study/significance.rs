//! Whether a change of the loss is more than chance.
//!
//! Two models are compared on the same pixels, so their common misfit cancels: what counts is each pixel's
//! difference of losses. Neighbouring pixels err alike (noise is filtered, a wrong shadow covers many), so
//! they are no independent witnesses; blocks of pixels nearly are. The standard error is that of a ratio of
//! block sums, and the change over it is a t-statistic. A bootstrap over the same blocks would draw from the
//! same sums and give the same error but for its own noise; the formula needs no random numbers.
//!
//! How large a block must be depends on the images. Block sides of 8, 16, 32, ... pixels are tried while 30
//! blocks or more are left, and the greatest error counts: too small blocks only ever make it too small.

use serde::Serialize;

/// The fewest blocks whose spread tells a standard error to within about an eighth.
const LEAST_BLOCKS: usize = 30;
/// A change beyond this number of standard errors is called significant: chance alone goes there once in 370 times.
pub const SIGNIFICANT: f64 = 3.0;

/// A view's losses, pixel by pixel.
#[derive(Clone, Debug)]
pub struct LossMap {
    /// Pixels in a row.
    pub width: usize,
    /// The weighted loss of each pixel, over its channels.
    pub loss: Vec<f64>,
    /// The weight of each pixel, over its channels.
    pub weight: Vec<f64>,
}

/// How much the mean loss changes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// The mean loss' change.
    pub loss: f64,
    /// Its standard error.
    pub std_error: f64,
    /// The change over its error; 0 where nothing changes. None where the model before leaves no misfit that a change
    /// could be mistaken for: any that is more than rounding is real.
    pub t: Option<f64>,
    /// The side of the blocks, in pixels.
    pub block: usize,
    /// What roundings of 32-bit numbers may do to the mean loss: a smaller change is none.
    pub rounding: f64,
}

impl Change {
    /// Whether it is beyond chance.
    #[must_use]
    pub fn is_significant(&self) -> bool {
        self.t.is_none_or(|t| t.abs() >= SIGNIFICANT) && !self.is_nothing()
    }

    /// Whether it is none, but for rounding.
    #[must_use]
    pub fn is_nothing(&self) -> bool {
        self.loss.abs() <= self.rounding
    }
}

/// The change of the mean loss from `before` to `after`, views in the same order and of the same pixels.
#[must_use]
pub fn change(before: &[LossMap], after: &[LossMap]) -> Change {
    let sides = std::iter::successors(Some(8), |side| Some(side * 2)).take(8);
    let mut best: Option<Change> = None;
    for side in sides {
        let blocks = blocks(before, after, side);
        if best.is_some() && blocks.len() < LEAST_BLOCKS {
            break;
        }
        let found = of_blocks(&blocks, side);
        if best.is_none_or(|best| found.std_error > best.std_error) {
            best = Some(found);
        }
    }
    best.unwrap_or(Change { loss: 0.0, std_error: 0.0, t: Some(0.0), block: 0, rounding: 0.0 })
}

/// For each block with any weight: the sum of differences, and of weights.
fn blocks(before: &[LossMap], after: &[LossMap], side: usize) -> Vec<(f64, f64)> {
    let mut all = Vec::new();
    for (before, after) in before.iter().zip(after) {
        let across = before.width.div_ceil(side).max(1);
        let rows = before.loss.len().div_ceil(before.width.max(1));
        let mut sums = vec![(0.0, 0.0); across * rows.div_ceil(side)];
        for (i, (&a, &b)) in before.loss.iter().zip(&after.loss).enumerate() {
            let (x, y) = (i % before.width, i / before.width);
            let sum = &mut sums[y / side * across + x / side];
            sum.0 += b - a;
            sum.1 += before.weight[i];
        }
        all.extend(sums.into_iter().filter(|sum| sum.1 > 0.0));
    }
    all
}

fn of_blocks(blocks: &[(f64, f64)], side: usize) -> Change {
    let (sum, weight) = blocks.iter().fold((0.0, 0.0), |(d, w), block| (d + block.0, w + block.1));
    if weight <= 0.0 || blocks.len() < 2 {
        return Change {
            loss: if weight > 0.0 { sum / weight } else { 0.0 },
            std_error: 0.0,
            t: Some(0.0),
            block: side,
            rounding: 0.0,
        };
    }
    let loss = sum / weight;
    let squares: f64 = blocks.iter().map(|(d, w)| (d - loss * w).powi(2)).sum();
    let n = blocks.len() as f64;
    let std_error = (squares * n / (n - 1.0)).sqrt() / weight;
    // Blocks that all change by the same share leave no error at all.
    let t = if loss == 0.0 { 0.0 } else { loss / std_error.max(1e-12 * loss.abs()) };
    Change { loss, std_error, t: Some(t), block: side, rounding: 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn map(loss: Vec<f64>) -> LossMap {
        LossMap { width: 128, weight: vec![1.0; loss.len()], loss }
    }

    /// Differences that are the same within squares of `side` pixels a side, and drawn anew for each.
    fn patches(side: usize, mean: f64, seed: u64) -> LossMap {
        let mut rng = rand::rngs::StdRng::seed_from_u64(seed);
        let across = 128 / side;
        let draws: Vec<f64> = (0..across * across).map(|_| mean + rng.random_range(-0.5..0.5_f64)).collect();
        map((0..128 * 128).map(|i| draws[i / 128 / side * across + i % 128 / side]).collect())
    }

    #[test]
    fn equal_models_do_not_differ_at_all() {
        let same = map(vec![0.3; 128 * 128]);
        let found = change(std::slice::from_ref(&same), std::slice::from_ref(&same));
        assert_eq!((found.loss, found.std_error, found.t), (0.0, 0.0, Some(0.0)));
        assert!(!found.is_significant());
    }

    #[test]
    fn where_there_was_no_misfit_only_rounding_is_no_change() {
        let change = |loss: f64| Change { loss, std_error: 1e-3, t: None, block: 8, rounding: 1e-9 };
        assert!(change(1e-6).is_significant() && !change(1e-10).is_significant());
    }

    #[test]
    fn the_error_is_that_of_as_many_draws_as_were_made() {
        let zero = map(vec![0.0; 128 * 128]);
        for side in [1, 4, 16] {
            let found = change(std::slice::from_ref(&zero), &[patches(side, 0.0, 7)]);
            // A uniform draw in [-0.5, 0.5) has a variance of 1/12.
            let want = (1.0 / 12.0_f64).sqrt() * side as f64 / 128.0;
            // The greatest of two or three estimates, from 64 blocks or more: each is off by 9%.
            assert!((0.85..1.4).contains(&(found.std_error / want)), "{side}: {} {want}", found.std_error);
            assert!(found.t.unwrap().abs() < 3.5, "{side}: {found:?}");
            assert!(change(std::slice::from_ref(&zero), &[patches(side, 6.0 * want, 7)]).is_significant());
        }
    }
}
