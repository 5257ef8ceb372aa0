//! How far the neighbours of a texel lie apart, as `shader/atlas/neighbours.wgsl` has it.

use rayon::prelude::*;

use super::{Number, Texel};
use crate::samples::Atlas;

/// For each texel how far what `source` holds is from one neighbour to the next, along u and along v: half the distance
/// of the two that are of the same chart, the distance to the one that is, or 0.
pub(super) fn neighbours<R: Number>(
    atlas: &Atlas,
    source: impl Fn(usize) -> Texel<R> + Sync,
) -> Vec<Texel<R>> {
    let zero = R::from(0.0);
    let along = |here: usize, [across, down]: [i64; 2]| {
        let [column, row] = atlas.texel(here).map(i64::from);
        let beside = [-1, 1].map(|side| atlas.place(column + side * across, row + side * down));
        let own = beside.map(|beside| beside.filter(|&beside| atlas.chart(beside) == atlas.chart(here)));
        let [before, after] = own.map(|own| source(own.unwrap_or(here)));
        let square = (0..3).fold(zero, |sum, c| sum + (after[c] - before[c]) * (after[c] - before[c]));
        let found = own.iter().flatten().count().max(1);
        square.sqrt() / zero.lit(found as f64)
    };
    (0..atlas.covered())
        .into_par_iter()
        .map(|here| [along(here, [1, 0]), along(here, [0, 1]), zero])
        .collect()
}
