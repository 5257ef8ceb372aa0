//! The radiance of one pixel, under each weighting.

use super::{Exposure, Weighting, clipping};
use crate::response::Curve;

/// An exposure where its pixels lie.
pub(super) struct Place<'a> {
    pub(super) exposure: &'a Exposure,
    pub(super) curve: &'a Curve,
    /// What to add to a pixel of the merged picture to find it in this exposure.
    pub(super) offset: (i64, i64),
}

impl Place<'_> {
    /// The index of what a pixel of the merged picture is in this exposure; `None` where it is outside.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<usize> {
        let inside = |at: usize, offset: i64, size: usize| {
            let moved = at as i64 + offset;
            (moved >= 0 && moved < size as i64).then_some(moved as usize)
        };
        let column = inside(x, self.offset.0, self.exposure.width)?;
        Some(inside(y, self.offset.1, self.exposure.height)? * self.exposure.width + column)
    }

    /// The exposure X of a channel of one of its pixels.
    pub(super) fn x(&self, pixel: usize, channel: usize) -> f64 {
        self.curve.exposures[usize::from(self.exposure.codes[pixel][channel])][channel]
    }

    /// X as a share of the full well.
    pub(super) fn filled(&self, pixel: usize, channel: usize) -> f64 {
        self.x(pixel, channel) / self.full(channel)
    }

    /// X of the highest code, which stands for the full well.
    fn full(&self, channel: usize) -> f64 {
        self.curve.exposures.last().map_or(1.0, |x| x[channel])
    }

    fn look(&self, pixel: usize, channel: usize) -> Look {
        let code = self.exposure.codes[pixel][channel];
        Look {
            x: self.filled(pixel, channel),
            slope: self.curve.slopes[usize::from(code)][channel] / self.full(channel),
            seconds: self.exposure.seconds,
            share: f64::from(code) / f64::from(self.exposure.most),
        }
    }
}

/// Who sees a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    /// As many exposures, in all channels.
    By(u8),
    /// None: all clip.
    Clipped,
    /// None sees one of the channels: all are dark.
    Dark,
    /// None sees one of the channels: the shorter are dark, the longer clip.
    Between,
}

/// What a pixel merges to.
pub(super) struct Pixel {
    pub(super) radiance: [f64; 3],
    pub(super) seen: Seen,
}

/// What sees a channel of a pixel: X and its derivative by the code, as shares of the full well; seconds; and the code as
/// a share of the highest.
#[derive(Clone, Copy)]
struct Look {
    x: f64,
    slope: f64,
    seconds: f64,
    share: f64,
}

/// Exposures to be merged.
pub(super) struct Merger<'a> {
    /// From the shortest to the longest.
    places: Vec<Place<'a>>,
    weighting: Weighting,
    /// Whether a clipped channel spoils the others of its pixel.
    pub(super) spoils: bool,
}

impl<'a> Merger<'a> {
    pub(super) fn new(mut places: Vec<Place<'a>>, weighting: Weighting) -> Self {
        places.sort_by(|a, b| a.exposure.seconds.total_cmp(&b.exposure.seconds));
        let spoils = clipping::spoils(&places);
        Self { places, weighting, spoils }
    }

    /// Whether an exposure tells the radiance of a channel of one of its pixels.
    fn sees(&self, exposure: &Exposure, pixel: usize, channel: usize) -> bool {
        if self.spoils { exposure.sees(pixel, channel) } else { exposure.open(pixel, channel) }
    }

    pub(super) fn pixel(&self, x: usize, y: usize) -> Pixel {
        let mut inside: Vec<(&Place<'_>, usize)> = Vec::with_capacity(self.places.len());
        inside.extend(self.places.iter().filter_map(|place| Some((place, place.at(x, y)?))));
        let Some((shortest, at)) = inside.first().copied() else {
            return Pixel { radiance: [0.0; 3], seen: Seen::Dark };
        };
        if inside.iter().all(|(place, at)| place.exposure.clips(*at)) {
            let radiance = std::array::from_fn(|c| shortest.x(at, c) / shortest.exposure.seconds);
            return Pixel { radiance, seen: Seen::Clipped };
        }
        let (mut radiance, mut seen) = ([0.0; 3], Seen::By(u8::MAX));
        let mut looks = Vec::with_capacity(inside.len());
        for c in 0..3 {
            looks.clear();
            let sees = |(place, at): &&(&Place<'_>, usize)| self.sees(place.exposure, *at, c);
            looks.extend(inside.iter().filter(sees).map(|(place, at)| place.look(*at, c)));
            let by = looks.len();
            if by == 0 {
                // Another channel's clipping spoils this one less than having nothing.
                let open = |(place, at): &&(&Place<'_>, usize)| place.exposure.open(*at, c);
                looks.extend(inside.iter().filter(open).map(|(place, at)| place.look(*at, c)));
            }
            (radiance[c], seen) = if looks.is_empty() {
                let (bound, of) = bound(&inside, c);
                (bound, if of == Seen::Dark && seen == Seen::Between { seen } else { of })
            } else {
                let fewer = match seen {
                    Seen::By(count) => Seen::By(count.min(by.min(255) as u8)),
                    other => other,
                };
                (shortest.full(c) * self.pooled(&looks), fewer)
            };
        }
        Pixel { radiance, seen }
    }

    /// The radiance of what sees a channel, in full wells a second.
    fn pooled(&self, looks: &[Look]) -> f64 {
        match self.weighting {
            Weighting::Noise { full_well, read_noise } => by_noise(looks, full_well, read_noise),
            Weighting::Hat => by_hat(looks),
        }
    }
}

/// What a channel is at least that no exposure sees.
fn bound(inside: &[(&Place<'_>, usize)], channel: usize) -> (f64, Seen) {
    let radiance = |(place, at): &(&Place<'_>, usize)| place.x(*at, channel) / place.exposure.seconds;
    let dark = |(place, at): &&(&Place<'_>, usize)| place.exposure.codes[*at][channel] == 0;
    // From the shortest on, so the first that is not dark clips with the least time, and tells the most.
    match inside.iter().find(|at| !dark(at)) {
        Some(clipped) => (radiance(clipped), Seen::Between),
        None => (inside.last().map_or(0.0, radiance), Seen::Dark),
    }
}

/// The mean of X / t by inverse variance. In shares of the full well, X = E t has the variance
/// E t / full_well + (read_noise / full_well)^2 + (dX / dcode)^2 / 12.
fn by_noise(looks: &[Look], full_well: f64, read_noise: f64) -> f64 {
    // All electrons over all seconds: the best estimate where the only noise is Poisson's.
    let seconds: f64 = looks.iter().map(|look| look.seconds).sum();
    let mut radiance = looks.iter().map(|look| look.x).sum::<f64>() / seconds;
    for _ in 0..3 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for look in looks {
            let read = read_noise / full_well;
            let variance = radiance * look.seconds / full_well + read * read + look.slope * look.slope / 12.0;
            // A flat piece of a table under no light and no readout would know everything.
            let weight = look.seconds * look.seconds / variance.max(1e-18);
            sum += weight * look.x / look.seconds;
            weights += weight;
        }
        radiance = sum / weights;
    }
    radiance
}

fn by_hat(looks: &[Look]) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for look in looks {
        let weight = look.share.min(1.0 - look.share);
        sum += weight * (look.x / look.seconds).max(f64::MIN_POSITIVE).ln();
        weights += weight;
    }
    (sum / weights).exp()
}
