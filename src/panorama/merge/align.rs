//! How far exposures are shifted against each other: median threshold bitmaps (Ward 2003).
//!
//! An exposure's bitmap says which pixels are above its median, which is the same place in the scene whatever the
//! shutter time. Bitmaps of two exposures are compared at nine shifts on a pyramid, from coarse to fine, leaving out
//! pixels too near the threshold to tell. Where the median clips, another percentile serves, the same for both.

use rayon::prelude::*;

use super::Exposure;

/// The longest way that is searched is 2 ^ this, less one, pixels.
const MOST_LEVELS: usize = 7;
/// The smaller side of the pyramid's coarsest picture, at least.
const COARSEST: usize = 16;
/// Percentiles that may split the pictures, the first where all do.
const SHARES: [f64; 9] = [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9];

/// How far one exposure is shifted against another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shift {
    /// The exposure that is compared with.
    pub from: usize,
    /// The exposure with the next longer shutter time.
    pub to: usize,
    /// What `from` shows at (x, y) stands in `to` at (x + this, y + ...), pixels to the right.
    pub x: i64,
    /// The same, pixels down.
    pub y: i64,
    /// Whether the two pictures told anything: they do not where one is all clipped or dark.
    pub told: bool,
    /// Whether it is as far as is searched, so that it may be farther.
    pub at_the_end: bool,
}

/// The shifts between exposures next in shutter time. The exposures must have been checked.
pub(super) fn shifts(exposures: &[Exposure]) -> Vec<Shift> {
    let greys: Vec<Grey> = exposures.par_iter().map(Grey::of).collect();
    let order = by_time(exposures);
    order.par_windows(2).map(|pair| shift(&greys, pair[0], pair[1])).collect()
}

/// What to add to a pixel of the exposure of the middle shutter time to find it in each.
pub(super) fn offsets(exposures: &[Exposure], shifts: &[Shift]) -> Vec<(i64, i64)> {
    let order = by_time(exposures);
    let mut offsets = vec![(0, 0); exposures.len()];
    for shift in shifts {
        let (x, y) = offsets[shift.from];
        offsets[shift.to] = (x + shift.x, y + shift.y);
    }
    let (x, y) = offsets[order[order.len() / 2]];
    offsets.iter().map(|offset| (offset.0 - x, offset.1 - y)).collect()
}

/// The exposures from the shortest to the longest; equal times keep their order.
fn by_time(exposures: &[Exposure]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..exposures.len()).collect();
    order.sort_by(|a, b| exposures[*a].seconds.total_cmp(&exposures[*b].seconds));
    order
}

/// A picture in grey, 16 bits.
struct Grey {
    width: usize,
    height: usize,
    pixels: Vec<u16>,
}

impl Grey {
    fn of(exposure: &Exposure) -> Self {
        let scale = 65535.0 / f64::from(exposure.most);
        // Ward's weights, in 256ths.
        let grey = |[r, g, b]: &[u16; 3]| {
            let sum = 54.0 * f64::from(*r) + 183.0 * f64::from(*g) + 19.0 * f64::from(*b);
            (sum / 256.0 * scale) as u16
        };
        Self {
            width: exposure.width,
            height: exposure.height,
            pixels: exposure.codes.iter().map(grey).collect(),
        }
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |i: usize| {
            let at = 2 * (i / width) * self.width + 2 * (i % width);
            let four = [at, at + 1, at + self.width, at + self.width + 1];
            (four.iter().map(|at| u32::from(self.pixels[*at])).sum::<u32>() / 4) as u16
        };
        Self { width, height, pixels: (0..width * height).map(mean).collect() }
    }

    /// The grey that a share of the pixels is below, for each of [`SHARES`].
    fn percentiles(&self) -> [u16; SHARES.len()] {
        let mut counts = vec![0usize; 1 << 16];
        for grey in &self.pixels {
            counts[usize::from(*grey)] += 1;
        }
        SHARES.map(|share| {
            let (below, mut sum) = (share * self.pixels.len() as f64, 0);
            let found = counts.iter().position(|count| {
                sum += count;
                sum as f64 > below
            });
            found.unwrap_or(65535) as u16
        })
    }

    /// For each pixel, 1 above the threshold and 0 below; 2 where it is too near.
    fn bitmap(&self, threshold: u16) -> Vec<u8> {
        // Ward's four codes of 255, less where the threshold is dark.
        let near = (4 * 257).min(threshold / 8).max(1);
        let bit = |grey: &u16| if grey.abs_diff(threshold) < near { 2 } else { u8::from(*grey > threshold) };
        self.pixels.iter().map(bit).collect()
    }
}

fn shift(greys: &[Grey], from: usize, to: usize) -> Shift {
    let nothing = Shift { from, to, x: 0, y: 0, told: false, at_the_end: false };
    let mut pyramid: Vec<(Grey, Grey)> = Vec::new();
    let mut levels = 1;
    while levels < MOST_LEVELS && greys[from].width.min(greys[from].height) >> levels >= COARSEST {
        let halved = match pyramid.last() {
            None => (greys[from].halved(), greys[to].halved()),
            Some((a, b)) => (a.halved(), b.halved()),
        };
        pyramid.push(halved);
        levels += 1;
    }
    let (mut x, mut y, mut told) = (0i64, 0i64, false);
    for level in (0..levels).rev() {
        (x, y) = (2 * x, 2 * y);
        let (a, b) = match level.checked_sub(1) {
            None => (&greys[from], &greys[to]),
            Some(halved) => (&pyramid[halved].0, &pyramid[halved].1),
        };
        let Some((of_a, of_b)) = thresholds(a, b) else { continue };
        told = true;
        let (bits_a, bits_b) = (a.bitmap(of_a), b.bitmap(of_b));
        let mut best = (f64::INFINITY, x, y);
        // Staying comes first, and another way must be better.
        for (dx, dy) in [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)] {
            let wrong = differing(&bits_a, &bits_b, a.width, a.height, x + dx, y + dy);
            if wrong < best.0 {
                best = (wrong, x + dx, y + dy);
            }
        }
        (x, y) = (best.1, best.2);
    }
    let end = (1i64 << levels) - 1;
    Shift { x, y, told, at_the_end: told && levels > 1 && x.abs().max(y.abs()) >= end, ..nothing }
}

/// The thresholds of two pictures at the percentile that is farthest from clipped and dark in both.
fn thresholds(a: &Grey, b: &Grey) -> Option<(u16, u16)> {
    let room =
        |(a, b): &(u16, u16)| [*a, *b].map(|grey| grey.min(65535 - grey)).into_iter().min().unwrap_or(0);
    let pairs = a.percentiles().into_iter().zip(b.percentiles());
    // The first of equals, so the median where it is as good.
    let best = pairs.rev().max_by_key(|pair| room(pair).min(40 * 257))?;
    (room(&best) > 2 * 257).then_some(best)
}

/// The share of pixels that differ where both tell, the second picture being shifted by (x, y).
fn differing(a: &[u8], b: &[u8], width: usize, height: usize, x: i64, y: i64) -> f64 {
    let overlap = |size: usize, by: i64| {
        let low = (-by).max(0).min(size as i64) as usize;
        let high = (size as i64 - by.max(0)).max(low as i64) as usize;
        low..high
    };
    let columns = overlap(width, x);
    let (mut wrong, mut told) = (0u64, 0u64);
    for row in overlap(height, y) {
        let of_a = &a[row * width..][columns.clone()];
        let start = (row as i64 + y) as usize * width + (columns.start as i64 + x).max(0) as usize;
        let of_b = &b[start.min(b.len())..];
        for (a, b) in of_a.iter().zip(of_b) {
            let both = *a < 2 && *b < 2;
            told += u64::from(both);
            wrong += u64::from(both && a != b);
        }
    }
    if told == 0 { f64::INFINITY } else { wrong as f64 / told as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A view of soft blobs, moved by (x, y) and exposed.
    fn exposure(x: i64, y: i64, seconds: f64) -> Exposure {
        let (width, height) = (200, 160);
        let pixel = |i: usize| {
            let (px, py) = ((i % width) as f64 - x as f64, (i / width) as f64 - y as f64);
            let light =
                1.5 + (px * 0.11 + 0.3 * (py * 0.05).sin()).sin() + (py * 0.13).cos() * (px * 0.031).sin();
            let code = ((light.max(0.0) * seconds).min(1.0).powf(1.0 / 2.2) * 255.0).round() as u16;
            [code; 3]
        };
        Exposure { width, height, codes: (0..width * height).map(pixel).collect(), most: 255, seconds }
    }

    #[test]
    fn shifts_are_found_to_the_pixel() {
        let exposures = [exposure(0, 0, 0.3), exposure(13, -7, 0.1), exposure(14, 2, 1.0)];
        let found = shifts(&exposures);
        let of = |i: usize| (found[i].from, found[i].to, found[i].x, found[i].y);
        assert_eq!((of(0), of(1)), ((1, 0, -13, 7), (0, 2, 14, 2)));
        assert_eq!(offsets(&exposures, &found), [(0, 0), (13, -7), (14, 2)]);
    }

    #[test]
    fn nothing_is_told_by_black_and_white() {
        let mut exposures = [exposure(0, 0, 0.3), exposure(0, 0, 1.0)];
        exposures[1].codes.fill([255; 3]);
        let found = shifts(&exposures)[0];
        assert!(!found.told && found.x == 0 && found.y == 0);
    }

    #[test]
    fn small_pictures_are_no_trouble() {
        let tiny = |seconds| Exposure { width: 1, height: 1, codes: vec![[100; 3]], most: 255, seconds };
        assert_eq!(shifts(&[tiny(1.0), tiny(2.0)]).len(), 1);
    }
}
