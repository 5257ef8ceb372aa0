//! The shots' orientations, refined from what they show in common.
//!
//! Gauss-Newton over a rotation vector and a ln gain for each shot but the first, on a lattice of directions: for each
//! two shots i and j that see one, the residual is (ln gain_i + ln L_i) - (ln gain_j + ln L_j). A turn by w of shot j
//! changes ln L_j by -(d x G) w, with G its gradient over the sphere; G is the mean of both shots' (Benhimane and Malis
//! 2004), which is right to the second order in w. From coarse to fine, as a step must not be longer than what is seen.
//! Residuals count by Tukey's biweight: parallax, clipped lamps and what moved are outliers. The orientations told are
//! a prior of 5 degrees, so that an overlap without features moves nothing.

use glam::{DQuat, DVec3};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::pyramid::Pyramid;
use super::view::View;
use super::{Shot, directions_of};
use crate::latlong::lattice;
use crate::robust::{biweight, deviation, median};

/// The orientations told are right to about this, radians.
const PRIOR: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// A pixel of the coarsest level, radians: wider than half of what orientations are off by.
const COARSEST: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Rounds at each level, at most.
const ROUNDS: usize = 20;
/// Directions that are added up at once; the sums' order must not depend on the number of threads.
const CHUNK: usize = 2048;

/// Refined orientations.
pub(super) struct Refined {
    pub(super) orientations: Vec<DQuat>,
    /// The residuals' deviation at the finest level, in ln radiance; `None` where no two shots overlap.
    pub(super) residual: Option<f64>,
    /// The correlation of what each shot shows with what those that it overlaps with show, at the finest level; `None`
    /// where it overlaps with none.
    pub(super) correlations: Vec<Option<f64>>,
}

/// One residual: of which pair, how much, what both show in the mean, and its derivative by a turn of the first shot.
struct Row {
    pair: (usize, usize),
    residual: f64,
    mean: f64,
    turn: DVec3,
}

/// Refines orientations (unit quaternions) until a step is below a hundredth of a pixel, or of a texel of `angle`
/// radians where that is finer than need be.
pub(super) fn refine(shots: &[Shot], told: &[DQuat], gains: &[f64], angle: f64) -> Refined {
    let mut orientations = told.to_vec();
    let mut logs: Vec<f64> = gains.iter().map(|gain| gain.ln()).collect();
    let views = |orientations: &[DQuat]| -> Vec<View<'_>> {
        shots.iter().zip(orientations).map(|(shot, orientation)| View::new(shot, *orientation)).collect()
    };
    let pixel_angles: Vec<f64> = views(told).iter().map(View::pixel_angle).collect();
    // The level at which a shot's pixels are about so wide.
    let level_of = |shot: usize, angle: f64| (angle / pixel_angles[shot]).log2().round().max(0.0) as usize;
    let pyramids: Vec<Pyramid> = views(told)
        .iter()
        .enumerate()
        .map(|(i, view)| Pyramid::new(view, level_of(i, COARSEST) + 1))
        .collect();
    let finest = pixel_angles.iter().copied().fold(f64::INFINITY, f64::min).max(0.4 * angle);
    let mut residual = None;
    let mut at = COARSEST.max(finest);
    loop {
        let levels: Vec<usize> =
            (0..shots.len()).map(|i| level_of(i, at).min(pyramids[i].count() - 1)).collect();
        for _ in 0..ROUNDS {
            let rows = rows(&views(&orientations), &pyramids, &levels, at);
            let Some((step, scale)) = step(&rows, &orientations, told, &logs) else { break };
            residual = Some(scale);
            let mut longest = 0f64;
            for i in 1..shots.len() {
                let mut turn = DVec3::from_slice(&step.as_slice()[4 * (i - 1)..][..3]);
                // Beyond two pixels the gradient tells nothing.
                turn = turn.clamp_length_max(2.0 * at);
                orientations[i] = (DQuat::from_scaled_axis(turn) * orientations[i]).normalize();
                logs[i] += step[4 * (i - 1) + 3].clamp(-1.0, 1.0);
                longest = longest.max(turn.length());
            }
            if longest < 1e-3 * at {
                break;
            }
        }
        if at <= finest {
            let rows = rows(&views(&orientations), &pyramids, &levels, at);
            let correlations = (0..shots.len()).map(|shot| correlation(&rows, shot)).collect();
            return Refined { orientations, residual, correlations };
        }
        at = (0.5 * at).max(finest);
    }
}

fn rows(views: &[View<'_>], pyramids: &[Pyramid], levels: &[usize], angle: f64) -> Vec<Row> {
    let directions = directions_of(angle, views.len());
    let chunk = |start: usize| {
        let mut rows = Vec::new();
        for i in start..(start + CHUNK).min(directions) {
            let direction = lattice(i, directions);
            let (right, up) = direction.any_orthonormal_pair();
            let signal = |shot: usize, direction: DVec3| {
                let (point, _) = views[shot].look(direction)?;
                pyramids[shot].at(levels[shot], point)
            };
            let seen: Vec<(usize, f64, DVec3)> = (0..views.len())
                .filter_map(|shot| {
                    let value = signal(shot, direction)?;
                    let along = |tangent: DVec3| {
                        let ahead = signal(shot, (direction + angle * tangent).normalize())?;
                        let behind = signal(shot, (direction - angle * tangent).normalize())?;
                        Some((ahead - behind) / (2.0 * angle))
                    };
                    Some((shot, value, right * along(right)? + up * along(up)?))
                })
                .collect();
            for (k, (i, of_i, slope_i)) in seen.iter().enumerate() {
                for (j, of_j, slope_j) in &seen[k + 1..] {
                    let turn = -direction.cross(0.5 * (*slope_i + *slope_j));
                    let mean = 0.5 * (of_i + of_j);
                    rows.push(Row { pair: (*i, *j), residual: of_i - of_j, mean, turn });
                }
            }
        }
        rows
    };
    let starts: Vec<usize> = (0..directions).step_by(CHUNK).collect();
    let chunks: Vec<Vec<Row>> = starts.into_par_iter().map(chunk).collect();
    chunks.into_iter().flatten().collect()
}

/// The correlation of a shot with others. Of two signals of variance s and correlation r, the difference has the variance
/// 2 s (1 - r) and the mean s (1 + r) / 2; both are taken by the median of distances.
fn correlation(rows: &[Row], shot: usize) -> Option<f64> {
    let of = |number: fn(&Row) -> f64| {
        let mine = rows.iter().filter(|row| row.pair.0 == shot || row.pair.1 == shot);
        let mut numbers: Vec<f64> = mine.map(number).collect();
        let middle = median(&mut numbers)?;
        Some(deviation(&numbers, middle).powi(2))
    };
    let (differing, common) = (of(|row| row.residual)?, 4.0 * of(|row| row.mean)?);
    // Without features nothing is alike.
    Some(if common > 0.0 { (common - differing) / (common + differing) } else { 0.0 })
}

/// A step of all shots but the first, four numbers each, and the residuals' deviation; `None` where nothing overlaps.
fn step(rows: &[Row], now: &[DQuat], told: &[DQuat], logs: &[f64]) -> Option<(DVector<f64>, f64)> {
    let residual = |row: &Row| logs[row.pair.0] - logs[row.pair.1] + row.residual;
    let mut residuals: Vec<f64> = rows.iter().map(residual).collect();
    let middle = median(&mut residuals)?;
    // Exactly alike is as good as a ten-thousandth apart.
    let scale = deviation(&residuals, middle).max(1e-4);
    let size = 4 * (now.len() - 1);
    let (mut matrix, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
    for row in rows {
        let residual = residual(row);
        // About the middle, so that a wrong gain throws nothing out.
        let weight = biweight((residual - middle) / scale);
        if weight <= 0.0 {
            continue;
        }
        let of_i = [row.turn.x, row.turn.y, row.turn.z, 1.0];
        let sides = [(row.pair.0, 1.0), (row.pair.1, -1.0)];
        for (shot, sign) in sides.into_iter().filter(|side| side.0 > 0) {
            for (a, slope) in of_i.iter().enumerate() {
                let at = 4 * (shot - 1) + a;
                right[at] -= weight * sign * slope * residual;
                for (other, other_sign) in sides.into_iter().filter(|side| side.0 > 0) {
                    for (b, other_slope) in of_i.iter().enumerate() {
                        matrix[(at, 4 * (other - 1) + b)] += weight * sign * slope * other_sign * other_slope;
                    }
                }
            }
        }
    }
    let prior = scale * scale / (PRIOR * PRIOR);
    for shot in 1..now.len() {
        let away = short(now[shot] * told[shot].conjugate());
        for (a, away) in away.to_array().into_iter().enumerate() {
            matrix[(4 * (shot - 1) + a, 4 * (shot - 1) + a)] += prior;
            right[4 * (shot - 1) + a] -= prior * away;
        }
        // A gain that nothing tells stays.
        matrix[(4 * shot - 1, 4 * shot - 1)] += 1e-6;
    }
    let step = matrix.cholesky()?.solve(&right);
    step.iter().all(|x| x.is_finite()).then_some((step, scale))
}

/// A turn's rotation vector, the shorter way around.
pub(super) fn short(turn: DQuat) -> DVec3 {
    if turn.w < 0.0 { (-turn).to_scaled_axis() } else { turn.to_scaled_axis() }
}
