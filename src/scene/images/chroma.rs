//! Colours of luminance and chroma: the channels Y, RY and BY of OpenEXR files.
//!
//! Y is the luminance, RY = (R - Y) / Y and BY = (B - Y) / Y. Chroma mostly has a sample for every other pixel of every
//! other line; between them it is reconstructed as OpenEXR's own reader does it (`ImfRgbaYca.h`, `ImfRgbaYca.cpp`), and
//! pixels that come out far more saturated than their neighbours are desaturated as there.

use exr::math::Vec2;
use rayon::prelude::*;

/// Half of OpenEXR's reconstruction filter of 27 taps (`reconstructChromaHoriz`): the weights of the samples at a distance of
/// 1, 3, 5, ... pixels on either side. At even distances there are none.
const TAPS: [f32; 7] = [0.627_123, -0.186_077, 0.087_929, -0.043_159, 0.019_597, -0.007_540, 0.002_128];

/// RY or BY as stored.
pub(super) struct Chroma {
    pub(super) samples: Vec<f32>,
    /// Pixels a sample, each 1 or 2.
    pub(super) sampling: Vec2<usize>,
}

/// R, G and B of an image `width` pixels wide, from its Y, its RY and BY, and how much luminance equal shares of the three
/// have.
pub(super) fn to_rgb(
    luminance: &[f32],
    chroma: [Chroma; 2],
    width: usize,
    shares: [f32; 3],
) -> Vec<[f32; 3]> {
    let reconstructed = chroma.iter().any(|plane| plane.sampling != Vec2(1, 1));
    let [ry, by] = chroma.map(|plane| plane.reconstructed(width));
    let rgb = luminance.iter().zip(ry.iter().zip(&by));
    let rgb: Vec<_> = rgb.map(|(&y, (&ry, &by))| rgb_of(y, ry, by, shares)).collect();
    if reconstructed { tamed(&rgb, width, shares) } else { rgb }
}

impl Chroma {
    /// A value for each pixel.
    fn reconstructed(self, width: usize) -> Vec<f32> {
        let Vec2(across, down) = self.sampling;
        let wide = if across == 2 { widened(&self.samples, width / 2) } else { self.samples };
        if down == 2 { heightened(&wide, width) } else { wide }
    }
}

/// A column between each two; `width` is that before.
fn widened(plane: &[f32], width: usize) -> Vec<f32> {
    let value = |row: &[f32], x: usize| {
        if x.is_multiple_of(2) { row[x / 2] } else { between(width, x / 2, |i| row[i]) }
    };
    plane.par_chunks_exact(width).flat_map_iter(|row| (0..2 * width).map(move |x| value(row, x))).collect()
}

/// A line between each two.
fn heightened(plane: &[f32], width: usize) -> Vec<f32> {
    let height = plane.len() / width;
    let value = |x: usize, y: usize| {
        let at = |i: usize| plane[i * width + x];
        if y.is_multiple_of(2) { at(y / 2) } else { between(height, y / 2, at) }
    };
    let value = &value;
    (0..2 * height).into_par_iter().flat_map_iter(|y| (0..width).map(move |x| value(x, y))).collect()
}

/// The value between sample `i` of `count` and the next. Beyond the edges the outermost go on, as OpenEXR pads
/// (`ImfRgbaFile.cpp`, `padTmpBuf` and `readYCAScanLine`).
fn between(count: usize, i: usize, at: impl Fn(usize) -> f32) -> f32 {
    let pair = |k: usize| at(i.saturating_sub(k)) + at((i + 1 + k).min(count - 1));
    TAPS.iter().enumerate().map(|(k, tap)| tap * pair(k)).sum()
}

/// R, G and B of a pixel (`YCAtoRGBA`). Without chroma it is grey to the last bit.
fn rgb_of(y: f32, ry: f32, by: f32, shares: [f32; 3]) -> [f32; 3] {
    if ry == 0.0 && by == 0.0 {
        return [y; 3];
    }
    let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
    [r, (y - r * shares[0] - b * shares[2]) / shares[1], b]
}

/// Desaturate pixels of far more saturation than their diagonal neighbours, and make negative radiance none
/// (`fixSaturation`): where bright meets dark the smooth chroma overshoots.
fn tamed(rgb: &[[f32; 3]], width: usize, shares: [f32; 3]) -> Vec<[f32; 3]> {
    let height = rgb.len() / width;
    let saturation: Vec<f32> = rgb.par_iter().map(saturation).collect();
    let mean = |x: usize, y: usize| {
        let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
        // Below the last line OpenEXR has the last but one, which has chroma samples.
        let (above, below) = (y.saturating_sub(1), if y + 1 < height { y + 1 } else { y.saturating_sub(1) });
        let at = |x: usize, y: usize| saturation[y * width + x];
        (0.25 * (at(left, above) + at(right, above) + at(left, below) + at(right, below))).min(1.0)
    };
    let tame = |i: usize| {
        let mean = mean(i % width, i / width);
        let most = 1.0 - (1.0 - mean) * 0.25;
        if saturation[i] > most { desaturated(rgb[i], most / saturation[i], shares) } else { rgb[i] }
    };
    (0..rgb.len()).into_par_iter().map(tame).collect()
}

/// 0 of grey, 1 where a channel has nothing, more where it is negative; 0 of what is not finite, which is refused later.
fn saturation(rgb: &[f32; 3]) -> f32 {
    let [r, g, b] = *rgb;
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    if most > 0.0 && rgb.iter().all(|value| value.is_finite()) { 1.0 - least / most } else { 0.0 }
}

/// The channels moved towards the greatest, to the share `kept` of their distance, at the same luminance.
fn desaturated(rgb: [f32; 3], kept: f32, shares: [f32; 3]) -> [f32; 3] {
    let luminance = |rgb: [f32; 3]| rgb.iter().zip(shares).map(|(value, share)| value * share).sum::<f32>();
    let most = rgb.into_iter().fold(0.0, f32::max);
    let moved = rgb.map(|value| (most - (most - value) * kept).max(0.0));
    let after = luminance(moved);
    if after > 0.0 { moved.map(|value| value * (luminance(rgb) / after)) } else { moved }
}
