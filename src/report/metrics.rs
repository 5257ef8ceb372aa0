//! How alike two images are: PSNR, SSIM and FLIP.
//!
//! All three compare sRGB-encoded values clipped to [0, 1], over the pixels whose coverage is at
//! least [`COVERED`]. Other pixels are black in both images, and count for nothing.

use super::filter::{Border, gaussian, separable};
use super::flip::flip;
use crate::render::files::Image;
use crate::render::tonemap::{srgb_decode, srgb_encode};

/// The least coverage of a pixel that is compared.
pub const COVERED: f32 = 0.999;

/// The PSNR, in dB, that stands for equal images: JSON knows no infinity.
pub const PSNR_OF_EQUALS: f64 = 200.0;

/// Two images made comparable.
#[derive(Clone, Debug)]
pub struct Comparison {
    width: usize,
    /// sRGB-encoded, in [0, 1].
    target: Vec<[f32; 3]>,
    fit: Vec<[f32; 3]>,
    covered: Vec<bool>,
    /// FLIP's error of each pixel.
    flip: Vec<f32>,
}

/// What [`Comparison`] says in three numbers.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Scores {
    /// Peak signal-to-noise ratio over all channels, dB; at most [`PSNR_OF_EQUALS`].
    pub psnr: f64,
    /// Mean structural similarity, 1 for equal images.
    pub ssim: f64,
    /// Mean FLIP error, 0 for equal images.
    pub flip: f64,
}

impl Comparison {
    /// Compare `fit` with `target`, two images of one size, where `coverage` (one a pixel) is full.
    ///
    /// # Panics
    /// When sizes differ; [`super::write_run`] checks them first.
    #[must_use]
    pub fn new(target: &Image, fit: &Image, coverage: &[f32]) -> Self {
        assert!(target.rgb.len() == fit.rgb.len() && fit.rgb.len() == coverage.len(), "sizes differ");
        let covered: Vec<bool> = coverage.iter().map(|&c| c >= COVERED).collect();
        let encode = |image: &Image| -> Vec<[f32; 3]> {
            let shown = |(rgb, &covered): (&[f32; 3], &bool)| {
                // A NaN is neither above 0 nor shown.
                rgb.map(|c| if covered && c > 0.0 { srgb_encode(c.min(1.0)) } else { 0.0 })
            };
            image.rgb.iter().zip(&covered).map(shown).collect()
        };
        let (target, fit, width) = (encode(target), encode(fit), fit.width);
        let linear = |image: &[[f32; 3]]| -> Vec<[f64; 3]> {
            image.iter().map(|rgb| rgb.map(|c| f64::from(srgb_decode(c)))).collect()
        };
        let flip = flip(&linear(&target), &linear(&fit), width);
        Self { width, target, fit, covered, flip }
    }

    /// FLIP's error of each pixel, row by row; about 0 where nothing is compared.
    #[must_use]
    pub fn flip_map(&self) -> &[f32] {
        &self.flip
    }

    /// Which pixels are compared.
    #[must_use]
    pub fn covered(&self) -> &[bool] {
        &self.covered
    }

    /// How many pixels are compared.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.covered.iter().filter(|&&c| c).count()
    }

    /// The three scores; `None` when no pixel is covered.
    #[must_use]
    pub fn scores(&self) -> Option<Scores> {
        Some(Scores { psnr: self.psnr()?, ssim: self.ssim()?, flip: self.flip()? })
    }

    /// Peak signal-to-noise ratio, dB: -10 lg of the mean squared difference of all channels.
    fn psnr(&self) -> Option<f64> {
        let squared =
            |i: usize| -> f64 { (0..3).map(|c| f64::from(self.target[i][c] - self.fit[i][c]).powi(2)).sum() };
        let mean = self.mean(squared)? / 3.0;
        Some(if mean > 0.0 { (-10.0 * mean.log10()).min(PSNR_OF_EQUALS) } else { PSNR_OF_EQUALS })
    }

    fn flip(&self) -> Option<f64> {
        self.mean(|i| f64::from(self.flip[i]))
    }

    /// Structural similarity (Wang et al. 2004): Gaussian windows of 11 x 11 with sigma 1.5,
    /// population variances, C1 = 0.01^2, C2 = 0.03^2; the mean over R, G and B. Windows see only
    /// covered pixels, their weights scaled to sum to 1.
    fn ssim(&self) -> Option<f64> {
        let maps = [0, 1, 2].map(|c| self.ssim_map(c));
        Some(self.mean(|i| maps[0][i] + maps[1][i] + maps[2][i])? / 3.0)
    }

    /// The structural similarity of channel `c` about each pixel.
    fn ssim_map(&self, c: usize) -> Vec<f64> {
        const C1: f64 = 0.01 * 0.01;
        const C2: f64 = 0.03 * 0.03;
        let moments = |i: usize| match self.covered[i] {
            true => {
                let (x, y) = (f64::from(self.target[i][c]), f64::from(self.fit[i][c]));
                [1.0, x, y, x * x, y * y, x * y]
            }
            false => [0.0; 6],
        };
        let planes: Vec<[f64; 6]> = (0..self.covered.len()).map(moments).collect();
        let window: [Vec<f64>; 6] = std::array::from_fn(|_| gaussian(1.5, 5));
        let similarity = |&[weight, x, y, xx, yy, xy]: &[f64; 6]| {
            // A window that sees nothing is about a pixel that is not compared.
            let scale = if weight > 0.0 { 1.0 / weight } else { 0.0 };
            let [x, y, xx, yy, xy] = [x, y, xx, yy, xy].map(|sum| sum * scale);
            let (var_x, var_y, cov) = (xx - x * x, yy - y * y, xy - x * y);
            ((2.0 * x * y + C1) * (2.0 * cov + C2)) / ((x * x + y * y + C1) * (var_x + var_y + C2))
        };
        separable(&planes, self.width, Border::Zero, &window, &window).iter().map(similarity).collect()
    }

    /// The mean of `value` over the compared pixels.
    fn mean(&self, value: impl Fn(usize) -> f64) -> Option<f64> {
        let covered = (0..self.covered.len()).filter(|&i| self.covered[i]);
        let (sum, count) = covered.fold((0.0, 0_usize), |(sum, n), i| (sum + value(i), n + 1));
        (count > 0).then(|| sum / count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference numbers below were made by this (Python 3.11, NumPy 2.4, SciPy,
    /// scikit-image 0.26, flip-evaluator 1.7, which is the FLIP authors' own program):
    ///
    /// ```python
    /// y, x = np.mgrid[0:48, 0:64]
    /// hash8 = lambda c: ((x*37 + y*101 + c*59 + (x*y)%97*13) % 256) / 255
    /// tri = lambda t: np.where(t%2 < 1, t%2, 2 - t%2)
    /// ref = np.stack([0.15 + 0.7*tri((x*(c+1) + 2*y) / 32) for c in range(3)], -1)
    /// test = np.stack([ref[..., c]*0.9 + 0.1*hash8(c) for c in range(3)], -1)
    /// test[20:28, 30:38] = [0.9, 0.2, 0.1]; test[:, 10] = 0
    /// ref, test = ref.astype(np.float32), test.astype(np.float32)
    /// mask = ((x-32)/28)**2 + ((y-24)/20)**2 < 1
    ///
    /// peak_signal_noise_ratio(ref, test, data_range=1)
    /// structural_similarity(ref, test, channel_axis=-1, gaussian_weights=True, sigma=1.5,
    ///                       use_sample_covariance=False, data_range=1, full=True)
    /// # the same with normalised windows: each moment is g(mask*a) / g(mask), with
    /// # g = scipy.ndimage.correlate1d in both directions, mode="constant"
    /// flip_evaluator.evaluate(ref, test, "LDR", inputsRGB=True, applyMagma=False,
    ///                         parameters={"ppd": 67.0})   # masked: of ref*mask and test*mask
    /// ```
    fn reference(masked: bool) -> Comparison {
        let (width, height) = (64, 48);
        let triangle = |t: f64| if t % 2.0 < 1.0 { t % 2.0 } else { 2.0 - t % 2.0 };
        let (mut target, mut fit) = (Image::new(width, height), Image::new(width, height));
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let i = y * width + x;
            for c in 0..3 {
                let value = 0.15 + 0.7 * triangle((x * (c + 1) + 2 * y) as f64 / 32.0);
                let hash = (x * 37 + y * 101 + c * 59 + (x * y) % 97 * 13) % 256;
                let mut changed = value * 0.9 + 0.1 * hash as f64 / 255.0;
                if (20..28).contains(&y) && (30..38).contains(&x) {
                    changed = [0.9, 0.2, 0.1][c];
                }
                if x == 10 {
                    changed = 0.0;
                }
                target.rgb[i][c] = srgb_decode(value as f32);
                fit.rgb[i][c] = srgb_decode(changed as f32);
            }
            let (u, v) = ((x as f64 - 32.0) / 28.0, (y as f64 - 24.0) / 20.0);
            fit.alpha[i] = if masked && u * u + v * v >= 1.0 { 0.5 } else { 1.0 };
        }
        Comparison::new(&target, &fit, &fit.alpha)
    }

    #[test]
    fn psnr_agrees_with_scikit_image() {
        // Encoding and decoding in f32 moves values by 1e-7, and the mean by less.
        assert!((reference(false).psnr().unwrap() - 20.069_139_75).abs() < 1e-5);
        let masked = reference(true);
        assert_eq!(masked.pixels(), 1749);
        assert!((masked.psnr().unwrap() - 19.701_380_47).abs() < 1e-5);
    }

    #[test]
    fn ssim_agrees_with_scikit_image_away_from_borders_and_with_normalised_windows_everywhere() {
        let comparison = reference(false);
        let maps = [0, 1, 2].map(|c| comparison.ssim_map(c));
        let inner = (5..43).flat_map(|y| (5..59).map(move |x| y * 64 + x));
        let sum: f64 = inner.map(|i| maps[0][i] + maps[1][i] + maps[2][i]).sum();
        // scikit-image keeps f32 images' moments in f32.
        assert!((sum / (3.0 * 38.0 * 54.0) - 0.792_440_1).abs() < 1e-5);
        for (y, x, want) in [
            (10, 20, [0.913_869_44, 0.925_485_1, 0.964_223_7]),
            (24, 34, [0.039_632_85, 0.080_741_41, 0.065_356_9]),
            (30, 10, [0.274_966_15, 0.206_064_28, 0.093_632_7]),
        ] {
            for c in 0..3 {
                assert!((maps[c][y * 64 + x] - want[c]).abs() < 1e-5, "{x} {y} {c}");
            }
        }
        // The NumPy recipe works in f64 from the f32 images, of which 1e-7 is lost here.
        assert!((comparison.ssim().unwrap() - 0.818_720_363).abs() < 1e-6);
        assert!((reference(true).ssim().unwrap() - 0.806_517_552).abs() < 1e-6);
    }

    #[test]
    fn flip_agrees_with_the_authors_program() {
        let comparison = reference(false);
        // Their filters run in f32: 43 taps of 1e-7 relative, amplified by powers below 1.
        let tolerance = 1e-5;
        for (y, x, want) in [
            (0, 0, 0.116_309_06),
            (10, 20, 0.125_510_9),
            (24, 34, 0.693_594_75),
            (30, 10, 0.428_601_7),
            (47, 63, 0.192_920_31),
        ] {
            let got = comparison.flip_map()[y * 64 + x];
            assert!((got - want).abs() < tolerance as f32, "{x} {y}: {got} {want}");
        }
        assert!((comparison.flip().unwrap() - 0.191_605_58).abs() < tolerance);
        assert!((reference(true).flip().unwrap() - 0.199_293_08).abs() < tolerance);
    }

    #[test]
    fn equal_images_are_equal_and_uncovered_pixels_count_for_nothing() {
        let mut image = Image::new(20, 10);
        for (i, rgb) in image.rgb.iter_mut().enumerate() {
            *rgb = [i as f32 / 200.0, 0.5, 1.5];
        }
        let mut coverage = vec![1.0; 200];
        let equal = Comparison::new(&image, &image, &coverage).scores().unwrap();
        // SSIM divides two equal numbers a few roundings apart.
        assert!((equal.ssim - 1.0).abs() < 1e-12);
        assert_eq!((equal.psnr, equal.flip), (PSNR_OF_EQUALS, 0.0));

        let mut other = image.clone();
        (coverage[3], other.rgb[3]) = (0.99, [f32::NAN, -4.0, 9.0]);
        let apart = Comparison::new(&image, &other, &coverage);
        assert_eq!(apart.pixels(), 199);
        assert_eq!(apart.scores().unwrap().psnr, PSNR_OF_EQUALS);
        assert_eq!(Comparison::new(&image, &other, &[0.0; 200]).scores(), None);
    }

    #[test]
    fn psnr_and_ssim_of_constants_follow_their_closed_forms() {
        let grey = |encoded: f32| {
            let rgb = vec![[srgb_decode(encoded); 3]; 16 * 16];
            Image { width: 16, height: 16, rgb, alpha: vec![1.0; 256] }
        };
        let comparison = Comparison::new(&grey(0.5), &grey(0.6), &[1.0; 256]);
        // f32 values of 0.5 and 0.6 through sRGB and back: 1e-7 relative to their difference of 0.1.
        assert!((comparison.psnr().unwrap() - 20.0).abs() < 1e-4);
        let closed = (2.0 * 0.5 * 0.6 + 1e-4) / (0.25 + 0.36 + 1e-4);
        assert!((comparison.ssim().unwrap() - closed).abs() < 1e-6);
    }

    #[test]
    fn clipped_values_are_compared_as_clipped() {
        let flat = |value: f32| Image { width: 1, height: 1, rgb: vec![[value; 3]], alpha: vec![1.0] };
        let scores = Comparison::new(&flat(1.0), &flat(7.0), &[1.0]).scores().unwrap();
        assert_eq!((scores.psnr, scores.flip), (PSNR_OF_EQUALS, 0.0));
    }
}
