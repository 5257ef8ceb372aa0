//! The exposure of shots against each other: for each two that overlap, where the ln ratios of their luminance lie
//! (robustly); over all pairs, least squares, the first shot's gain standing as told.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::view::View;
use crate::latlong::lattice;
use crate::picture::luminance;
use crate::robust::{location, median};

/// Directions that are looked at, over the whole sphere.
const DIRECTIONS: usize = 60_000;
/// Directions that two shots must both see.
const NEEDED: usize = 32;

/// What the overlaps tell.
pub(super) struct Gains {
    /// The gain of each shot.
    pub(super) gains: Vec<f64>,
    /// For each two shots that overlap: which, and how many of [`DIRECTIONS`] both see well.
    pub(super) pairs: Vec<(usize, usize, usize)>,
}

/// The gains of views, from those told; a view that hangs together with the first one by no overlap keeps its own.
pub(super) fn solve(views: &[View<'_>], told: &[f64]) -> Gains {
    let count = views.len();
    let all: Vec<(usize, usize)> = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).collect();
    let found: Vec<Option<(f64, usize)>> =
        all.par_iter().map(|(i, j)| ratio(&views[*i], &views[*j])).collect();
    let mut pairs = Vec::new();
    let (mut matrix, mut right) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
    for ((i, j), found) in all.into_iter().zip(found) {
        let Some((log, directions)) = found else { continue };
        pairs.push((i, j, directions));
        // ln gain_i + ln L_i = ln gain_j + ln L_j, in what is to be added to the told ones.
        let differ = log + (told[j] / told[i]).ln();
        let weight = directions as f64;
        matrix[(i, i)] += weight;
        matrix[(j, j)] += weight;
        matrix[(i, j)] -= weight;
        matrix[(j, i)] -= weight;
        right[i] += weight * differ;
        right[j] -= weight * differ;
    }
    // The first stands. Others are held by a thousandth of a direction, which decides where nothing else does.
    matrix[(0, 0)] += 1e12;
    for i in 1..count {
        matrix[(i, i)] += 1e-3;
    }
    let linked = linked(count, &pairs);
    let logs = matrix.cholesky().map(|solver| solver.solve(&right));
    let gain = |i: usize| {
        let log = logs.as_ref().map_or(0.0, |logs| logs[i]);
        let gain = told[i] * log.exp();
        if linked[i] && i > 0 && gain.is_finite() && gain > 0.0 { gain } else { told[i] }
    };
    Gains { gains: (0..count).map(gain).collect(), pairs }
}

/// Which shots hang together with the first by overlaps.
pub(super) fn linked(count: usize, pairs: &[(usize, usize, usize)]) -> Vec<bool> {
    let mut linked = vec![false; count];
    if let Some(first) = linked.first_mut() {
        *first = true;
    }
    for _ in 0..count {
        for (i, j, _) in pairs {
            let either = linked[*i] || linked[*j];
            (linked[*i], linked[*j]) = (either, either);
        }
    }
    linked
}

/// ln (L_b / L_a) where both see, and in how many directions they do.
fn ratio(a: &View<'_>, b: &View<'_>) -> Option<(f64, usize)> {
    let mut both = Vec::new();
    for i in 0..DIRECTIONS {
        let direction = lattice(i, DIRECTIONS);
        let (Some((of_a, _)), Some((of_b, _))) = (a.look(direction), b.look(direction)) else { continue };
        let light = |view: &View<'_>, point| luminance(view.shot.picture.bicubic(point));
        both.push((light(a, of_a), light(b, of_b)));
    }
    // Below a hundredth of the median, readout noise is more than light.
    let least = |lights: &mut Vec<f64>| 0.01 * median(lights).unwrap_or(0.0);
    let least_a = least(&mut both.iter().map(|(a, _)| *a).collect());
    let least_b = least(&mut both.iter().map(|(_, b)| *b).collect());
    let bright = |(a, b): &&(f64, f64)| *a > 0.0 && *b > 0.0 && *a >= least_a && *b >= least_b;
    let mut logs: Vec<f64> = both.iter().filter(bright).map(|(a, b)| (b / a).ln()).collect();
    let count = logs.len();
    if count < NEEDED {
        return None;
    }
    Some((location(&mut logs)?, count))
}
