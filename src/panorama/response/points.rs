//! Which pixels a response is recovered from: well spread over values and over the image, and where the image is flat.

use crate::merge::Exposure;

/// Ranges of values, each of which gives pixels.
const RANGES: usize = 256;
/// Pixels that are considered for a range.
const CONSIDERED: usize = 48;
/// The flattest of them, which are taken.
const TAKEN: usize = 16;
/// Pixels that are looked at, at most.
const LOOKED_AT: usize = 1 << 20;

/// What one pixel shows in each exposure that sees it: the exposure's index, and its code on a scale of 0 to 255.
pub(super) type Point = Vec<(usize, f64)>;

/// The pixels of `channel` to look at.
///
/// Values are told apart by the sum of codes over all exposures, which rises with radiance over the whole range that
/// any of them sees; one exposure's code tells nothing where that one clips.
pub(super) fn points(exposures: &[Exposure], channel: usize) -> Vec<Point> {
    let [first, ..] = exposures else { return Vec::new() };
    let pixels = first.width * first.height;
    let looked_at = pixels.min(LOOKED_AT);
    let highest = 255.0 * exposures.len() as f64;
    let mut ranges: Vec<Vec<(f64, usize)>> = vec![Vec::new(); RANGES];
    let step = step(pixels);
    for i in 0..looked_at {
        let at = scattered(i, step, pixels);
        let seen = exposures.iter().filter(|exposure| exposure.sees(at, channel)).count();
        if seen < 2 {
            continue;
        }
        let sum: f64 = exposures.iter().map(|exposure| level(exposure, at, channel)).sum();
        let range = &mut ranges[((sum / highest * RANGES as f64) as usize).min(RANGES - 1)];
        if range.len() < CONSIDERED {
            range.push((unevenness(exposures, at, channel), at));
        }
    }
    let mut taken = Vec::new();
    for range in &mut ranges {
        range.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        taken.extend(range.iter().take(TAKEN).map(|(_, at)| *at));
    }
    let seen = |at: usize| {
        let all = exposures.iter().enumerate().filter(move |(_, exposure)| exposure.sees(at, channel));
        all.map(|(j, exposure)| (j, level(exposure, at, channel))).collect()
    };
    taken.into_iter().map(seen).collect()
}

/// The pixel that is looked at as the `i`-th: all of them once, in an order that jumps over the image by `step`.
fn scattered(i: usize, step: usize, pixels: usize) -> usize {
    (i as u128 * step as u128 % pixels as u128) as usize
}

/// A step without a common divisor visits all pixels; near the golden ratio, any part of the order is spread evenly.
fn step(pixels: usize) -> usize {
    let mut step = ((pixels as f64 * 0.618_033_988_75) as usize).max(1);
    while gcd(step, pixels) != 1 {
        step += 1;
    }
    step
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn level(exposure: &Exposure, at: usize, channel: usize) -> f64 {
    f64::from(exposure.codes[at][channel]) * 255.0 / f64::from(exposure.most)
}

/// How much the codes around a pixel differ from its own, over the exposures: at an edge, a shake of the camera or the
/// sensor's mosaic shows as another radiance.
fn unevenness(exposures: &[Exposure], at: usize, channel: usize) -> f64 {
    let (width, height) = (exposures[0].width, exposures[0].height);
    let (x, y) = (at % width, at / width);
    let mut sum = 0.0;
    for exposure in exposures {
        let own = level(exposure, at, channel);
        for (near, other) in [
            (x > 0, at.wrapping_sub(1)),
            (x + 1 < width, at + 1),
            (y > 0, at.wrapping_sub(width)),
            (y + 1 < height, at + width),
        ] {
            if near {
                sum += (level(exposure, other, channel) - own).abs();
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_once() {
        for pixels in [1, 2, 3, 64, 100, 97] {
            let mut seen: Vec<usize> = (0..pixels).map(|i| scattered(i, step(pixels), pixels)).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..pixels).collect::<Vec<_>>());
        }
    }
}
