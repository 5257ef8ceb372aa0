//! The response recovered from exposures of one view (Debevec and Malik 1997, section 2.1).
//!
//! For each channel, g = ln X of 256 codes and ln E of each pixel minimise the sum over pixels i and exposures j of
//! (w(z_ij) (g(z_ij) - ln E_i - ln t_j))^2, and lambda times the sum over codes z of (w(z) g''(z))^2, with g(128) = 0
//! and w a hat over the codes. The ln E are taken out beforehand (each stands in its own rows only), so that the system
//! has 256 unknowns for any number of pixels.

use nalgebra::{DMatrix, DVector};

use super::points::{Point, points};
use super::{Response, ResponseError, srgb};
use crate::merge::{Exposure, check_exposures};

/// Codes that have an unknown of their own; finer codes lie between two.
const CODES: usize = 256;
/// The code whose exposure all channels agree on.
const MIDDLE: usize = 128;
/// Pixels that are needed: with two exposures, each brings one equation.
const NEEDED: usize = 64;

/// The smoothness that does for 8-bit pictures. Where all shutter times are powers of one ratio, the pictures leave free
/// what repeats in ln X with that ratio, and only smoothness keeps it out: at a thirtieth of this, rounding to 8 bits is
/// off by 4 %; at thirty times this, the bend of a gamma at code 20 is, by 7 %.
pub const SMOOTHNESS: f64 = 3.0;

/// A recovered response.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovered {
    /// A table of 256 rows. All channels have the sRGB EOTF's exposure at code 128, so that radiance has the scale that
    /// it has under [`Response::Srgb`], and grey of a middle code is grey: pictures of one view tell neither.
    pub response: Response,
    /// How far the pixels' ln exposure lies from it, weighted root mean square, rgb: 0.02 is 2 %.
    pub residual: [f64; 3],
    /// Pixels that it rests on, rgb.
    pub pixels: [usize; 3],
    /// The lowest and the highest code (of 255) among them, rgb; beyond them the response is carried on smoothly.
    pub codes: [(f64, f64); 3],
}

/// The response of a camera from two or more exposures of one view whose shutter times are known.
///
/// `smoothness` is Debevec and Malik's lambda for each pixel that is looked at, usually [`SMOOTHNESS`]. Pixels are taken
/// evenly over values and over the image, where it is flat. The view must not move between the exposures.
///
/// # Errors
/// Exposures that do not belong together, or that do not determine a response.
pub fn recover(exposures: &[Exposure], smoothness: f64) -> Result<Recovered, ResponseError> {
    check_exposures(exposures)?;
    let seconds = || exposures.iter().map(|exposure| exposure.seconds);
    let (shortest, longest) = (seconds().fold(f64::INFINITY, f64::min), seconds().fold(0.0, f64::max));
    if longest < 1.2 * shortest {
        return Err(ResponseError::EqualTimes(exposures.len()));
    }
    let times: Vec<f64> = seconds().map(f64::ln).collect();
    let mut table = vec![[0.0; 3]; CODES];
    let mut recovered =
        Recovered { response: Response::Srgb, residual: [0.0; 3], pixels: [0; 3], codes: [(0.0, 255.0); 3] };
    for channel in 0..3 {
        let points = points(exposures, channel);
        if points.len() < NEEDED {
            return Err(ResponseError::TooFew { channel, found: points.len(), needed: NEEDED });
        }
        let smoothness = if smoothness.is_finite() { smoothness.max(1e-3) } else { SMOOTHNESS };
        let logs = solve(&points, &times, smoothness * points.len() as f64)
            .ok_or(ResponseError::Undetermined(channel))?;
        let logs = rising(&logs);
        recovered.residual[channel] = residual(&points, &times, &logs);
        recovered.pixels[channel] = points.len();
        let levels = || points.iter().flatten().map(|(_, level)| *level);
        recovered.codes[channel] = (levels().fold(255.0, f64::min), levels().fold(0.0, f64::max));
        let middle = srgb(MIDDLE as f64 / 255.0);
        for (row, log) in table.iter_mut().zip(&logs) {
            // Bounds of 1e+-26 that no camera reaches: a wild end of the table is a number still.
            row[channel] = middle * (log - logs[MIDDLE]).clamp(-60.0, 60.0).exp();
        }
    }
    recovered.response = Response::Table(table);
    recovered.response.check()?;
    Ok(recovered)
}

/// The hat: how much a code is trusted, 1 in the middle and 0 at both ends.
fn hat(level: f64) -> f64 {
    (level.min(255.0 - level) / 127.5).max(0.0)
}

/// A code between two of the table's: both, and the share of the upper one.
fn between(level: f64) -> [(usize, f64); 2] {
    let low = (level as usize).min(CODES - 2);
    let share = level - low as f64;
    [(low, 1.0 - share), (low + 1, share)]
}

fn solve(points: &[Point], times: &[f64], smoothness: f64) -> Option<Vec<f64>> {
    let mut matrix = DMatrix::<f64>::zeros(CODES, CODES);
    let mut right = DVector::<f64>::zeros(CODES);
    for point in points {
        // Each row is sum_k c_k g_k - ln E = ln t, weighted; the best ln E is the weighted mean of the rest, so each
        // row less that mean is what remains.
        let weights: Vec<f64> = point.iter().map(|(_, level)| hat(*level).powi(2)).collect();
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            continue;
        }
        let mean_time = point.iter().zip(&weights).map(|((j, _), w)| w * times[*j]).sum::<f64>() / total;
        let entries: Vec<(usize, f64, f64, f64)> = point
            .iter()
            .zip(&weights)
            .flat_map(|((j, level), w)| between(*level).map(|(code, share)| (code, share, *w, times[*j])))
            .collect();
        for (code, share, weight, time) in &entries {
            right[*code] += weight * share * (time - mean_time);
            for (other, other_share, other_weight, _) in &entries {
                matrix[(*code, *other)] -= weight * share * other_weight * other_share / total;
            }
        }
        for ((_, level), weight) in point.iter().zip(&weights) {
            let pair = between(*level);
            for (a, share_a) in pair {
                for (b, share_b) in pair {
                    matrix[(a, b)] += weight * share_a * share_b;
                }
            }
        }
    }
    for code in 1..CODES - 1 {
        let weight = smoothness * hat(code as f64).powi(2);
        for (i, a) in [1.0, -2.0, 1.0].into_iter().enumerate() {
            for (j, b) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                matrix[(code + i - 1, code + j - 1)] += weight * a * b;
            }
        }
    }
    // g(128) = 0, without which a constant is free.
    matrix[(MIDDLE, MIDDLE)] += points.len() as f64;
    let solved = matrix.cholesky()?.solve(&right);
    solved.iter().all(|x| x.is_finite()).then(|| solved.iter().copied().collect())
}

/// The nearest logs that nowhere fall: neighbours that do are pooled (Ayer et al. 1955), by their weights.
fn rising(logs: &[f64]) -> Vec<f64> {
    let mut pools: Vec<(f64, f64, usize)> = Vec::with_capacity(logs.len());
    for (code, log) in logs.iter().enumerate() {
        let mut pool = (*log, hat(code as f64) + 1e-6, 1);
        while let Some(before) = pools.pop_if(|before| before.0 > pool.0) {
            let weight = before.1 + pool.1;
            pool = ((before.0 * before.1 + pool.0 * pool.1) / weight, weight, before.2 + pool.2);
        }
        pools.push(pool);
    }
    pools.iter().flat_map(|(log, _, count)| std::iter::repeat_n(*log, *count)).collect()
}

fn residual(points: &[Point], times: &[f64], logs: &[f64]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for point in points {
        let radiance = |(j, level): &(usize, f64)| {
            between(*level).iter().map(|(code, share)| share * logs[*code]).sum::<f64>() - times[*j]
        };
        let weight = |(_, level): &(usize, f64)| hat(*level).powi(2);
        let weights: f64 = point.iter().map(weight).sum();
        if weights <= 0.0 {
            continue;
        }
        let mean = point.iter().map(|at| weight(at) * radiance(at)).sum::<f64>() / weights;
        sum += point.iter().map(|at| weight(at) * (radiance(at) - mean).powi(2)).sum::<f64>();
        // One number of each pixel went into its radiance.
        total += weights * (point.len() - 1) as f64 / point.len() as f64;
    }
    if total > 0.0 { (sum / total).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light falling on 128 x 96 pixels over four decades, smooth, with all values everywhere.
    fn brackets(code: impl Fn(f64, usize) -> f64, most: u16) -> Vec<Exposure> {
        let (width, height) = (128, 96);
        let exposure = |seconds: f64| {
            let pixel = |i: usize| {
                let (x, y) = ((i % width) as f64 / 128.0, (i / width) as f64 / 96.0);
                let radiance =
                    10f64.powf(4.0 * (0.5 + 0.3 * (5.0 * x).sin() * (4.0 * y).cos() + 0.2 * (x - y)) - 2.0);
                std::array::from_fn(|c| {
                    (code((radiance * seconds).min(1.0), c) * f64::from(most)).round() as u16
                })
            };
            Exposure { width, height, codes: (0..width * height).map(pixel).collect(), most, seconds }
        };
        [1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0, 4.0].map(exposure).into()
    }

    /// The largest error of X over codes 20 to 235 of 255, relative, where both are scaled to agree at 128.
    fn error(recovered: &Recovered, light: impl Fn(f64, usize) -> f64) -> f64 {
        let mut most = 0f64;
        for code in 20..=235 {
            for c in 0..3 {
                let got = recovered.response.exposure(f64::from(code) / 255.0)[c] / srgb(128.0 / 255.0);
                let truth = light(f64::from(code) / 255.0, c) / light(128.0 / 255.0, c);
                most = most.max((got / truth - 1.0).abs());
            }
        }
        most
    }

    /// A toe and a shoulder, others in each channel: code = x^p / (x^p + a (1 - x)^p) over x = light ^ (1 / 2.2).
    fn film(light: f64, c: usize) -> f64 {
        let (x, p) = (light.powf(1.0 / 2.2), [1.3, 1.4, 1.2][c]);
        x.powf(p) / (x.powf(p) + [0.8, 0.7, 0.9][c] * (1.0 - x).powf(p))
    }

    fn film_light(code: f64, c: usize) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if film(middle, c) < code { low = middle } else { high = middle }
        }
        low
    }

    #[test]
    fn gamma_and_film_come_back() {
        for most in [255, 65535] {
            let gamma = recover(&brackets(|x, _| x.powf(1.0 / 2.2), most), SMOOTHNESS).unwrap();
            let worst = error(&gamma, |code, _| code.powf(2.2));
            println!("gamma, {most}: {worst:.5}");
            // 1 %: the codes are rounded, by up to 5 % of X at 20, and the pixels' mean takes that down.
            assert!(worst < 0.01, "{worst}");
            let curve = recover(&brackets(film, most), SMOOTHNESS).unwrap();
            let worst = error(&curve, film_light);
            println!("film, {most}: {worst:.5}, residual {:?}", curve.residual);
            assert!(worst < 0.01, "{worst}");
        }
    }

    #[test]
    fn falling_logs_are_pooled() {
        let logs: Vec<f64> = (0..256).map(|i| f64::from(i) + if i == 100 { 30.0 } else { 0.0 }).collect();
        assert!(rising(&logs).windows(2).all(|pair| pair[0] <= pair[1]));
        let straight: Vec<f64> = (0..256).map(f64::from).collect();
        assert_eq!(rising(&straight), straight);
    }

    #[test]
    fn brackets_that_tell_nothing_are_refused() {
        let mut same = brackets(|x, _| x, 255);
        for exposure in &mut same {
            exposure.seconds = 0.1;
        }
        assert_eq!(recover(&same, SMOOTHNESS), Err(ResponseError::EqualTimes(5)));
        assert!(recover(&same[..1], SMOOTHNESS).is_err());
        assert!(recover(&[], SMOOTHNESS).is_err());
        let black = brackets(|_, _| 0.0, 255);
        assert!(matches!(recover(&black, SMOOTHNESS), Err(ResponseError::TooFew { found: 0, .. })));
        // One picture told as five exposures contradicts any response, but ends in no panic and no NaN.
        let mut told = same;
        for (i, exposure) in told.iter_mut().enumerate() {
            exposure.seconds = 0.1 * 2f64.powi(i as i32);
        }
        if let Ok(recovered) = recover(&told, f64::NAN) {
            assert_eq!(recovered.response.check(), Ok(()));
        }
    }
}
