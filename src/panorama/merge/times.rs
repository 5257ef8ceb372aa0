//! Whether the shutter times fit the pictures.
//!
//! For each two exposures, the median of ln (X_j / X_i) over what both see well is ln of how much longer j was open,
//! whatever the view. Least squares over all pairs give each exposure's time but for a common factor; with it, the
//! median exposure is right, so that one wrong time among three or more is the one that stands out.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::pixel::Place;
use crate::robust::median;

/// Pixels that are looked at, at most.
const LOOKED_AT: usize = 100_000;
/// Pixels that two exposures must both see.
const NEEDED: usize = 64;
/// The lowest code that counts, as a share of the highest: below, rounding alone is worth 5 %.
const LOWEST: f64 = 20.0 / 255.0;

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
    let (width, height) = (a.exposure.width, a.exposure.height);
    let step = (width * height / LOOKED_AT).max(1);
    let told = (b.exposure.seconds / a.exposure.seconds).ln();
    let mut logs = Vec::new();
    for i in (0..width * height).step_by(step) {
        // From the merged picture's pixel to each one's.
        let (Some(of_a), Some(of_b)) = (a.at(i % width, i / width), b.at(i % width, i / width)) else {
            continue;
        };
        for c in 0..3 {
            let well = |place: &Place<'_>, at: usize| {
                let share = f64::from(place.exposure.codes[at][c]) / f64::from(place.exposure.most);
                share >= LOWEST && place.exposure.sees(at, c) && place.x(at, c) > 0.0
            };
            if well(a, of_a) && well(b, of_b) {
                logs.push((b.x(of_b, c) / a.x(of_a, c)).ln() - told);
            }
        }
    }
    (logs.len() >= NEEDED).then(|| (median(&mut logs).unwrap_or(0.0), logs.len()))
}
