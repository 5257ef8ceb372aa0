//! What two exposures show of the same light.

use super::pixel::Place;

/// Pixels that are looked at, at most.
const LOOKED_AT: usize = 100_000;
/// The lowest code that counts, as a share of the highest: below, rounding alone is worth 5 %.
const LOWEST: f64 = 20.0 / 255.0;

/// A channel of a pixel that neither of two exposures has dark; whether it clips is not looked at.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    /// The first exposure's pixel.
    pub(super) a: usize,
    /// The second exposure's.
    pub(super) b: usize,
    pub(super) channel: usize,
}

/// The pairs of two exposures.
pub(super) fn pairs(a: &Place<'_>, b: &Place<'_>) -> impl Iterator<Item = Pair> {
    let (width, height) = (a.exposure.width, a.exposure.height);
    let step = (width * height / LOOKED_AT).max(1);
    // From the merged picture's pixel to each one's.
    let both = move |i: usize| Some((a.at(i % width, i / width)?, b.at(i % width, i / width)?));
    let pixels = (0..width * height).step_by(step).filter_map(both);
    let channels = pixels.flat_map(|(a, b)| (0..3).map(move |channel| Pair { a, b, channel }));
    channels.filter(|pair| lit(a, pair.a, pair.channel) && lit(b, pair.b, pair.channel))
}

/// Whether a code is well above rounding, and stands for light.
fn lit(place: &Place<'_>, pixel: usize, channel: usize) -> bool {
    let share = f64::from(place.exposure.codes[pixel][channel]) / f64::from(place.exposure.most);
    share >= LOWEST && place.x(pixel, channel) > 0.0
}
