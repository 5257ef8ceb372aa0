//! Sums over the surface by distance in space (MODEL 6, "Truth"): what blurs along the atlas' axes are measured against.
//!
//! A texel becomes the mean of all that face its way, across charts, weighed by area_j exp(-|P_i - P_j|^2 / 2 v). Texels
//! beyond six deviations are left out: over a plane these are exp(-18), 1.5e-8, of the weight. (A texel without an area of
//! its own that has none within six deviations so stays as it is, where the whole sum would follow the nearest of those
//! beyond, however far.) Texels stand in cells of a grid over space, so that a sum reads those nearby alone.

use std::collections::HashMap;
use std::f64::consts::LOG2_E;
use std::ops::Range;

use rayon::prelude::*;

use super::{Number, Texel};

/// How many standard deviations away a texel counts.
const REACH: f64 = 6.0;

/// Cells of the grid along a reach: fewer hold much that lies beyond, more are mostly empty.
const CELLS: f64 = 2.0;

/// A texel where it lies.
struct Placed<R> {
    place: Texel<R>,
    facing: Texel<R>,
    area: R,
    /// Its place among the covered texels.
    index: u32,
}

/// The texels of an atlas in cells of a grid.
pub(super) struct Surface<R> {
    placed: Vec<Placed<R>>,
    cells: HashMap<[i64; 3], Range<usize>>,
    /// Along a cell's edge.
    side: f64,
}

/// A level that is summed up; where the variance moves, how the level does, or that it stays.
pub(super) type Source<'a, R> = (&'a [Texel<R>], Option<Option<&'a [Texel<R>]>>);

impl<R: Number> Surface<R> {
    /// Of where texels lie, which way they face, and what area each has; `widest` is the greatest variance of a sum over
    /// them.
    fn new(places: &[Texel<R>], facing: &[Texel<R>], areas: &[Texel<R>], widest: f64) -> Self {
        let side = (REACH * widest.max(0.0).sqrt() / CELLS).max(f64::MIN_POSITIVE);
        let mut order: Vec<([i64; 3], u32)> =
            (0..).zip(places).map(|(index, place)| (cell(place, side), index)).collect();
        order.par_sort_unstable();
        let mut cells = HashMap::new();
        for (at, (cell, _)) in order.iter().enumerate() {
            cells.entry(*cell).or_insert(at..at).end = at + 1;
        }
        let placed = order.iter().map(|&(_, index)| {
            let i = index as usize;
            Placed { place: places[i], facing: facing[i], area: areas[i][0], index }
        });
        Self { placed: placed.collect(), cells, side }
    }

    /// The mean around a texel, or how it moves where the variance does; [`blurred`](super::blur::blurred)'s form, of
    /// differences to the texel: what is alike everywhere stays so to the bit.
    fn mean(
        &self,
        here: &Placed<R>,
        [variance, variance_moves, _]: Texel<R>,
        (source, moving): Source<'_, R>,
    ) -> Texel<R> {
        let zero = R::from(0.0);
        let index = here.index as usize;
        let own = moving.map_or(source[index], |moved| moved.map_or([zero; 3], |moved| moved[index]));
        if !zero.lt(variance) {
            return own;
        }
        let most = zero.lit(REACH * REACH) * variance;
        let (scale, half) = (zero.lit(-0.5 * LOG2_E) / variance, zero.lit(0.5));
        let (mut sum, mut weights) = ([zero; 3], zero);
        let (mut change, mut change_of_weights) = ([zero; 3], zero);
        for near in self.around(&here.place, most.into()) {
            let apart: Texel<R> = std::array::from_fn(|c| near.place[c] - here.place[c]);
            let square = dot(&apart, &apart);
            if most.lt(square) || !zero.lt(dot(&near.facing, &here.facing)) {
                continue;
            }
            let weight = near.area * (scale * square).exp2();
            let at = near.index as usize;
            (0..3).for_each(|c| sum[c] = sum[c] + weight * (source[at][c] - source[index][c]));
            weights = weights + weight;
            if let Some(moved) = moving {
                // d exp(-s / 2v) = exp(-s / 2v) s / 2v^2 dv.
                let moves = weight * half * square / (variance * variance) * variance_moves;
                change_of_weights = change_of_weights + moves;
                for c in 0..3 {
                    let along = moved.map_or(zero, |moved| moved[at][c] - moved[index][c]);
                    change[c] = change[c] + moves * (source[at][c] - source[index][c]) + weight * along;
                }
            }
        }
        if !zero.lt(weights) {
            return own;
        }
        std::array::from_fn(|c| match moving {
            None => own[c] + sum[c] / weights,
            Some(_) => own[c] + (change[c] - change_of_weights * sum[c] / weights) / weights,
        })
    }

    /// Texels in the cells that a sphere about a place meets, always in the same order; `square` is its squared radius.
    fn around(&self, place: &Texel<R>, square: f64) -> impl Iterator<Item = &Placed<R>> {
        let reach = square.sqrt();
        let ends = place.map(|x| {
            let x: f64 = x.into();
            [((x - reach) / self.side).floor() as i64, ((x + reach) / self.side).floor() as i64]
        });
        let along = |axis: usize| ends[axis][0]..=ends[axis][1];
        let (ys, zs) = (along(1), along(2));
        let cells = along(0).flat_map(move |x| {
            let zs = zs.clone();
            ys.clone().flat_map(move |y| zs.clone().map(move |z| [x, y, z]))
        });
        cells.filter_map(|cell| self.cells.get(&cell)).flat_map(|range| &self.placed[range.clone()])
    }
}

/// The cell that a place lies in.
fn cell<R: Number>(place: &Texel<R>, side: f64) -> [i64; 3] {
    place.map(|x| {
        let x: f64 = x.into();
        (x / side).floor() as i64
    })
}

fn dot<R: Number>(a: &Texel<R>, b: &Texel<R>) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The means of a level around each texel; `kernel` holds each one's variance, and how it moves. All cores; the same for any
/// number of threads.
pub(super) fn means<R: Number>(
    [places, facing, areas]: [&[Texel<R>]; 3],
    kernel: &[Texel<R>],
    source: Source<'_, R>,
) -> Vec<Texel<R>> {
    let widest = kernel.iter().map(|[variance, ..]| (*variance).into()).fold(0.0, f64::max);
    let surface = Surface::new(places, facing, areas, widest);
    // Neighbours in space are neighbours here, so what a texel reads was read for the one before.
    let mean = |here: &Placed<R>| (here.index, surface.mean(here, kernel[here.index as usize], source));
    let made: Vec<(u32, Texel<R>)> = surface.placed.par_iter().map(mean).collect();
    let mut means = vec![[R::from(0.0); 3]; made.len()];
    made.into_iter().for_each(|(index, mean)| means[index as usize] = mean);
    means
}
