//! Whether the shutter times fit the pictures.
//!
//! For each two exposures, the median of ln (X_j / X_i) over what both see well is ln of how much longer j was open,
//! whatever the view. Least squares over all pairs give each exposure's time but for a common factor; with it, the
//! median exposure is right, so that one wrong time among three or more is the one that stands out.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::pairs::{Pair, pairs};
use super::pixel::Place;
use crate::robust::median;

/// Pixels that two exposures must both see.
const NEEDED: usize = 64;

/// An exposure's shutter time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShutterTime {
    /// Seconds, as told.
    pub told: f64,
    /// Seconds, as the pictures have it; `None` where too few pixels are seen by this and another exposure. Of two
    /// exposures none is known to be the wrong one: the first stands as told.
    pub measured: Option<f64>,
}

/// The shutter times of exposures.
pub(super) fn measure(places: &[Place<'_>]) -> Vec<ShutterTime> {
    let count = places.len();
    let pairs: Vec<(usize, usize)> = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).collect();
    let ratios: Vec<Option<(f64, usize)>> =
        pairs.par_iter().map(|(i, j)| ratio(&places[*i], &places[*j])).collect();
    let (mut matrix, mut right) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
    // Exposures that hang together, each by the lowest of them.
    let mut group: Vec<usize> = (0..count).collect();
    for ((i, j), ratio) in pairs.iter().zip(&ratios) {
        let Some((log, pixels)) = ratio else { continue };
        let weight = (*pixels as f64).sqrt();
        for (a, b, sign) in [(*i, *j, -1.0), (*j, *i, 1.0)] {
            matrix[(a, a)] += weight;
            matrix[(a, b)] -= weight;
            right[a] += sign * weight * log;
        }
        let (low, high) = (group[*i].min(group[*j]), group[*i].max(group[*j]));
        group.iter_mut().filter(|of| **of == high).for_each(|of| *of = low);
    }
    // The common factor is free, so a trace of the identity decides it, and the median takes its place below.
    for i in 0..count {
        matrix[(i, i)] += 1e-6;
    }
    let logs = matrix.cholesky().map(|solver| solver.solve(&right));
    let measured = |i: usize| {
        let mut together: Vec<f64> = (0..count)
            .filter(|j| group[*j] == group[i])
            .map(|j| logs.as_ref().map_or(0.0, |logs| logs[j]))
            .collect();
        let right = match together.len() {
            1 => return None,
            2 => together[0],
            _ => median(&mut together)?,
        };
        let seconds = places[i].exposure.seconds * (logs.as_ref()?[i] - right).exp();
        seconds.is_finite().then_some(seconds)
    };
    (0..count).map(|i| ShutterTime { told: places[i].exposure.seconds, measured: measured(i) }).collect()
}

/// ln of how much longer `b` was open against `a` than told, and the number of values that it rests on.
fn ratio(a: &Place<'_>, b: &Place<'_>) -> Option<(f64, usize)> {
    let told = (b.exposure.seconds / a.exposure.seconds).ln();
    let seen = |pair: &Pair| a.exposure.sees(pair.a, pair.channel) && b.exposure.sees(pair.b, pair.channel);
    let log = |pair: Pair| (b.x(pair.b, pair.channel) / a.x(pair.a, pair.channel)).ln() - told;
    let mut logs: Vec<f64> = pairs(a, b).filter(seen).map(log).collect();
    (logs.len() >= NEEDED).then(|| (median(&mut logs).unwrap_or(0.0), logs.len()))
}
