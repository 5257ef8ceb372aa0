//! Whether a clipped channel spoils the others of its pixel.
//!
//! Demosaicing, colour matrices and JPEG mix channels, so that beside a clipped one the others may be wrong. Where they
//! do not, these are the best that is known of their light: what shorter exposures have of it has more noise. The
//! exposures tell which it is: light differs between two of them beside clipped channels as it does elsewhere, or more.

use super::pairs::{Pair, pairs};
use super::pixel::Place;

/// Values that either side of the comparison needs: of 500, noise alone takes five beyond the limit, and more than the
/// ten that may be by one chance in 70.
const NEEDED: usize = 500;
/// The share of the values elsewhere that is within the limit.
const WITHIN: f64 = 0.99;
/// The share of the values beside clipped channels that may be beyond it: twice what is elsewhere. A shift by half of
/// a standard deviation takes as many there, and so does one value in a hundred that is quite wrong.
const MOST_BEYOND: f64 = 0.02;

/// Whether clipped channels spoil others, by exposures from the shortest to the longest; so, too, where they do not tell.
pub(super) fn spoils(places: &[Place<'_>]) -> bool {
    let (mut elsewhere, mut beside) = (Vec::new(), Vec::new());
    for next in places.windows(2) {
        let (short, long) = (&next[0], &next[1]);
        let known = |pair: &Pair| {
            short.exposure.sees(pair.a, pair.channel) && long.exposure.open(pair.b, pair.channel)
        };
        for pair in pairs(short, long).filter(known) {
            let side = if long.exposure.clips(pair.b) { &mut beside } else { &mut elsewhere };
            side.push(difference(short, long, pair));
        }
    }
    if elsewhere.len().min(beside.len()) < NEEDED {
        return true;
    }
    let limit = ((elsewhere.len() - 1) as f64 * WITHIN) as usize;
    let limit = *elsewhere.select_nth_unstable_by(limit, f64::total_cmp).1;
    let beyond = beside.iter().filter(|difference| **difference > limit).count();
    beyond as f64 > MOST_BEYOND * beside.len() as f64
}

/// How far the light of two exposures differs, over the root of what Poisson noise makes of its variance but for a factor
/// that all have. Rounding goes along: codes of a camera's curve are about as fine as that noise at any light.
fn difference(short: &Place<'_>, long: &Place<'_>, pair: Pair) -> f64 {
    let (of_short, of_long) = (short.filled(pair.a, pair.channel), long.filled(pair.b, pair.channel));
    let (brief, lasting) = (short.exposure.seconds, long.exposure.seconds);
    let light = (of_short + of_long) / (brief + lasting);
    (of_long / lasting - of_short / brief).abs() / (light / brief + light / lasting).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::merge::Exposure;
    use crate::response::{Curve, Response};

    const SIZE: usize = 128;

    /// An orange view under linear codes of 16 bits; where red clips, `spilt` of what it has too much goes to green.
    fn exposure(seconds: f64, spilt: f64) -> Exposure {
        let pixel = |i: usize| {
            let light = seconds * (0.2 + 0.8 * (i % SIZE) as f64 / SIZE as f64);
            // Noise of a kind, another in each exposure: up to 0.2 % where light is 1, and as Poisson's elsewhere.
            let noise = 2e-3 * ((i as f64 * 12.9898 + seconds * 78.233).sin() * 43758.5453).fract();
            let [r, g, b] = [1.0, 0.6, 0.3].map(|colour| colour * light + noise * (colour * light).sqrt());
            [r, g + spilt * (r - 1.0).max(0.0), b].map(|x| (x.min(1.0) * 65535.0).round() as u16)
        };
        let codes = (0..SIZE * SIZE).map(pixel).collect();
        Exposure { width: SIZE, height: SIZE, codes, most: 65535, seconds }
    }

    fn spoilt(exposures: &[Exposure]) -> bool {
        let curve = Curve::new(&Response::Gamma(1.0), 65535);
        let place = |exposure| Place { exposure, curve: &curve, offset: (0, 0) };
        spoils(&exposures.iter().map(place).collect::<Vec<_>>())
    }

    #[test]
    fn channels_that_mix_are_told_from_those_that_do_not() {
        assert!(!spoilt(&[exposure(0.4, 0.0), exposure(1.6, 0.0)]));
        // Up to 0.6 is too much of red, so that green is off by up to 6 %, and the noise is 0.2 %.
        assert!(spoilt(&[exposure(0.4, 0.1), exposure(1.6, 0.1)]));
    }

    #[test]
    fn exposures_that_do_not_tell_leave_clipped_pixels_out() {
        assert!(spoilt(&[exposure(1.6, 0.0)]));
        // In none of them anything clips.
        assert!(spoilt(&[exposure(0.2, 0.0), exposure(0.8, 0.0)]));
    }
}
