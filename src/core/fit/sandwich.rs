//! Standard errors where neighbouring residuals are alike: the sandwich covariance, with squares of pixels as clusters.
//!
//! Where a model misses what an image shows, a pixel's residual tells its neighbours': there are fewer independent
//! witnesses than pixels, and errors of independent residuals are too small. With squares of pixels so large that one
//! tells little of the next, and g_b = J'Wr over square b, `B = b / (b - 1) sum(g_b g_b')` estimates the variance of J'Wr
//! whatever the residuals within a square do, and `H^-1 B H^-1` with H = J'WJ that of the answer (Huber 1967, *The behavior
//! of maximum likelihood estimates under nonstandard conditions*; White 1980, Econometrica 48; for clusters Liang and Zeger
//! 1986, Biometrika 73). It asks for no constant variance either.
//!
//! How far residuals are alike shows in their autocorrelation along rows and columns: up to the first lag at which it is no
//! more than `CHANCE` standard errors of itself (Bartlett 1946, *On the theoretical specification and sampling properties
//! of autocorrelated time-series*: those of an autocorrelation whose squares add up to s over n pixels are sqrt(s / n)).
//! Squares are `SIDES` times that wide, as of a square as wide as the range itself a third of what neighbours do would be
//! left out; but not so wide that fewer than `LEAST_BLOCKS` are left.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::engine::pulls::{Pulls, ResidualImage, TILE};

/// An autocorrelation of more standard errors is one.
const CHANCE: f64 = 3.0;
/// The side of a square over the range within which residuals are alike.
const SIDES: usize = 3;
/// Pixels from which autocorrelations are taken, over all views; of more, of every so-many-th row.
const MOST_PIXELS: usize = 1 << 20;
/// The fewest squares whose spread tells an error to within a tenth.
const LEAST_BLOCKS: usize = 50;

/// How residuals hang together, and the squares that were taken for independent.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Blocks {
    /// The lag in pixels at which residuals are not alike any more: 1 of independent ones.
    pub alike: usize,
    /// The side of the squares, in pixels.
    pub side: usize,
    /// How many squares there are.
    pub count: usize,
    /// The autocorrelation of next neighbours.
    pub next: f64,
}

/// `H^-1 B H^-1` of the unknowns that `inverse`, the pseudo-inverse of J'WJ, has; `slope` is the derivative of each unknown
/// by its coordinate. `None` with fewer than two squares.
pub(super) fn sandwich(
    inverse: &DMatrix<f64>,
    pulls: &Pulls,
    slope: &[f64],
) -> Option<(DMatrix<f64>, Blocks)> {
    let (alike, next) = range(&pulls.residuals);
    let mut tiles = (SIDES * alike).div_ceil(TILE).max(1);
    let mut sums = summed(pulls, tiles);
    while sums.len() < LEAST_BLOCKS && tiles > 1 {
        tiles -= 1;
        sums = summed(pulls, tiles);
    }
    let count = sums.len();
    if count < 2 {
        return None;
    }
    let k = slope.len();
    let mut meat = DMatrix::zeros(k, k);
    for pull in &sums {
        let pull = DVector::from_fn(k, |i, _| pull[i] * slope[i]);
        meat.ger(1.0, &pull, &pull, 1.0);
    }
    meat *= count as f64 / (count as f64 - 1.0);
    let covariance = inverse * meat * inverse;
    let finite = covariance.iter().all(|x| x.is_finite());
    finite.then_some((covariance, Blocks { alike, side: tiles * TILE, count, next }))
}

/// J'Wr over squares of `tiles` tiles a side.
fn summed(pulls: &Pulls, tiles: usize) -> Vec<Vec<f64>> {
    let mut sums: BTreeMap<(usize, u32, u32), Vec<f64>> = BTreeMap::new();
    for tile in &pulls.tiles {
        let place = (tile.view, tile.row / tiles as u32, tile.column / tiles as u32);
        let sum = sums.entry(place).or_insert_with(|| vec![0.0; tile.pull.len()]);
        sum.iter_mut().zip(&tile.pull).for_each(|(sum, x)| *sum += x);
    }
    sums.into_values().collect()
}

/// The first lag at which residuals are not alike, and the autocorrelation of next neighbours.
fn range(images: &[ResidualImage]) -> (usize, f64) {
    let widest = images.iter().map(|image| image.width).max().unwrap_or(0);
    // The sum of squares along a line, on either side of 0; over the plane it is about its square.
    let (mut next, mut line, mut last) = (0.0, 1.0, 0);
    for lag in lags().take_while(|&lag| lag < widest.max(2)) {
        let (rho, pairs) = autocorrelation(images, lag);
        if lag == 1 {
            next = rho;
        }
        // A pixel has a pair in its row and one in its column.
        if rho <= CHANCE * line / (0.5 * pairs.max(1) as f64).sqrt() {
            return (lag, next);
        }
        line += 2.0 * (lag - last) as f64 * rho * rho;
        last = lag;
    }
    (widest.max(1), next)
}

/// 1, 2, 3, 4, 6, 8, 12, 16, ...
fn lags() -> impl Iterator<Item = usize> {
    [1].into_iter().chain((1..30).flat_map(|power| [1 << power, 3 << (power - 1)]))
}

/// Of pixels that far apart in a row or a column, over all channels; and how many pairs there are.
fn autocorrelation(images: &[ResidualImage], lag: usize) -> (f64, u64) {
    let (mut product, mut square, mut pairs) = (0.0, 0.0, 0);
    let all: usize = images.iter().map(|image| image.pixels.len()).sum();
    let rows = all.div_ceil(MOST_PIXELS).max(1);
    for ResidualImage { width, pixels } in images {
        for (i, pixel) in pixels.iter().enumerate() {
            let Some(here) = pixel.as_ref().filter(|_| i / width % rows == 0) else { continue };
            let across = (i % width + lag < *width).then_some(i + lag);
            for other in [across, Some(i + lag * width)].into_iter().flatten() {
                let Some(Some(there)) = pixels.get(other) else { continue };
                for (&a, &b) in here.iter().zip(there) {
                    let (a, b) = (f64::from(a), f64::from(b));
                    product += a * b;
                    square += 0.5 * (a * a + b * b);
                    // Channels that are not compared, and clipped pixels, have none.
                    pairs += u64::from(a != 0.0 || b != 0.0);
                }
            }
        }
    }
    (if square > 0.0 { product / square } else { 0.0 }, pairs)
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::engine::pulls::Tile;

    const SIDE: usize = 256;

    /// Residuals that are the same within squares of `side` pixels a side, of variance 1.
    fn patches(side: usize, seed: u64) -> Vec<f32> {
        let mut rng = StdRng::seed_from_u64(seed);
        let across = SIDE.div_ceil(side);
        let draws: Vec<f32> =
            (0..across * across).map(|_| 3_f32.sqrt() * rng.random_range(-1.0..1.0_f32)).collect();
        (0..SIDE * SIDE).map(|i| draws[i / SIDE / side * across + i % SIDE / side]).collect()
    }

    /// The cluster scores of one unknown whose derivative is 1 in every pixel: sums of residuals.
    fn pulls(residuals: &[f32]) -> Pulls {
        let pixels = residuals.iter().map(|&r| Some([r, 0.0, 0.0, 0.0])).collect();
        let across = SIDE / TILE;
        let place = |k: usize| ((k % across) as u32, (k / across) as u32);
        let tile = |(column, row)| Tile { view: 0, column, row, pull: vec![0.0] };
        let mut tiles: Vec<Tile> = (0..across * across).map(place).map(tile).collect();
        for (i, &r) in residuals.iter().enumerate() {
            tiles[i / SIDE / TILE * across + i % SIDE / TILE].pull[0] += f64::from(r);
        }
        Pulls { residuals: vec![ResidualImage { width: SIDE, pixels }], tiles }
    }

    #[test]
    fn the_error_of_a_mean_is_that_of_as_many_draws_as_were_made() {
        let n = (SIDE * SIDE) as f64;
        for (side, alike) in [(1, 1..=1), (4, 4..=6), (8, 8..=12), (16, 16..=24)] {
            let (covariance, blocks) =
                sandwich(&DMatrix::from_element(1, 1, 1.0 / n), &pulls(&patches(side, 3)), &[1.0]).unwrap();
            let want = side as f64 / SIDE as f64;
            let ratio = covariance[(0, 0)].sqrt() / want;
            // 49 to 1024 squares tell their spread to within a tenth, and squares that cut patches miss a tenth.
            assert!((0.75..1.25).contains(&ratio), "{side}: {ratio} {blocks:?}");
            assert!(alike.contains(&blocks.alike), "{side}: {blocks:?}");
            assert!(blocks.count >= LEAST_BLOCKS || blocks.side == TILE, "{blocks:?}");
            // Of neighbours 1 in `side` stands across an edge.
            assert!((blocks.next - (1.0 - 1.0 / side as f64)).abs() < 0.03, "{side}: {blocks:?}");
        }
    }

    #[test]
    fn coordinates_are_those_of_the_unknowns_by_their_slope() {
        let pulls = pulls(&patches(1, 5));
        let one =
            |slope: f64| sandwich(&DMatrix::from_element(1, 1, 1.0), &pulls, &[slope]).unwrap().0[(0, 0)];
        // A square of one slope, to a few roundings.
        assert!((one(3.0) / one(1.0) - 9.0).abs() < 1e-12);
    }

    #[test]
    fn one_square_tells_nothing() {
        let mut few = pulls(&patches(1, 1));
        few.tiles.truncate(1);
        assert!(sandwich(&DMatrix::from_element(1, 1, 1.0), &few, &[1.0]).is_none());
        assert!(sandwich(&DMatrix::from_element(1, 1, 1.0), &Pulls::default(), &[1.0]).is_none());
    }
}
