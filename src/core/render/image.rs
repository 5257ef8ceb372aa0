//! Images in memory.

use std::path::Path;

use rayon::prelude::*;

use super::error::ImageFileError;
pub use super::error::{MAX_PIXELS, MAX_SIDE};
use super::tonemap::ToneMap;

/// An image in linear Rec.709, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Radiance, premultiplied by alpha; `height x width`.
    pub rgb: Vec<[f32; 3]>,
    /// Coverage in [0, 1]; `height x width`.
    pub alpha: Vec<f32>,
}

impl Image {
    /// A black, transparent image.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, rgb: vec![[0.0; 3]; width * height], alpha: vec![0.0; width * height] }
    }

    /// The image in front of a grey of linear radiance `background` as sRGB bytes, three a pixel, row by row. All cores.
    #[must_use]
    pub fn encoded(&self, tone: ToneMap, background: f32) -> Vec<u8> {
        let shown =
            |(rgb, alpha): (&[f32; 3], &f32)| tone.encode_bytes(rgb.map(|c| c + (1.0 - alpha) * background));
        let pixels: Vec<[u8; 3]> = self.rgb.par_iter().zip(&self.alpha).map(shown).collect();
        pixels.into_flattened()
    }

    /// This image shrunk by a whole factor (means of squares of pixels) to at most `longest` a side.
    #[must_use]
    pub fn shrunk(&self, longest: usize) -> Self {
        let factor = self.width.max(self.height).div_ceil(longest).max(1);
        if factor == 1 {
            return self.clone();
        }
        let mut small = Self::new(self.width.div_ceil(factor), self.height.div_ceil(factor));
        for y in 0..small.height {
            for x in 0..small.width {
                let (mut rgb, mut alpha, mut n) = ([0.0; 3], 0.0, 0.0);
                for row in y * factor..((y + 1) * factor).min(self.height) {
                    for column in x * factor..((x + 1) * factor).min(self.width) {
                        let i = row * self.width + column;
                        (0..3).for_each(|c| rgb[c] += self.rgb[i][c]);
                        (alpha, n) = (alpha + self.alpha[i], n + 1.0);
                    }
                }
                small.rgb[y * small.width + x] = rgb.map(|c| c / n);
                small.alpha[y * small.width + x] = alpha / n;
            }
        }
        small
    }

    /// Whether sizes agree, are within limits, and every number is finite.
    pub(super) fn check(&self, path: &Path) -> Result<(), ImageFileError> {
        let (width, height) = (self.width, self.height);
        let pixels = width.checked_mul(height).filter(|&n| n > 0 && n <= MAX_PIXELS);
        if pixels.is_none() || width > MAX_SIDE || height > MAX_SIDE {
            return Err(ImageFileError::Size { path: path.to_owned(), width, height });
        }
        if pixels != Some(self.rgb.len()) || pixels != Some(self.alpha.len()) {
            let found = format!("{} colours and {} alphas", self.rgb.len(), self.alpha.len());
            return Err(ImageFileError::Shape { path: path.to_owned(), width, height, found });
        }
        let finite = |i: usize| self.rgb[i].iter().chain([&self.alpha[i]]).all(|v| v.is_finite());
        match (0..self.rgb.len()).find(|&i| !finite(i)) {
            Some(i) => Err(ImageFileError::NotFinite { path: path.to_owned(), x: i % width, y: i / width }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_keeps_means() {
        let mut image = Image::new(7, 5);
        image.rgb.iter_mut().enumerate().for_each(|(i, rgb)| *rgb = [i as f32; 3]);
        let small = image.shrunk(4);
        assert_eq!((small.width, small.height), (4, 3));
        // The square of pixels 0, 1, 7 and 8; the last corner is a pixel alone.
        assert_eq!(small.rgb[0], [4.0; 3]);
        assert_eq!(small.rgb[11], [34.0; 3]);
        assert_eq!(image.shrunk(7), image);
    }
}
