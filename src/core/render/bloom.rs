//! The bloom that the haze drives: haze-weighted colour, blurred, and added to the image.

use rayon::prelude::*;

use super::image::Image;

/// Add the Gaussian blur of `glow` to the image: colour times haze, one value a pixel. `sigma` is the blur's
/// standard deviation as a share of the image's height.
///
/// # Panics
/// When `glow` is not as long as the image's pixels.
pub fn add_bloom(image: &mut Image, glow: &[[f32; 3]], sigma: f64) {
    let (width, height) = (image.width, image.height);
    assert_eq!(glow.len(), width * height, "a pixel glows once");
    let kernel = kernel(height, sigma);
    let across = blur(glow, width, height, 1, &kernel);
    let glow = blur(&across, width, height, width, &kernel);
    for (rgb, glow) in image.rgb.iter_mut().zip(glow) {
        for c in 0..3 {
            rgb[c] += glow[c];
        }
    }
}

/// Half of the normalised Gaussian for images of that height, from its middle outwards to three standard
/// deviations.
pub fn kernel(height: usize, sigma: f64) -> Vec<f32> {
    let sigma = sigma * height as f64;
    let radius = (3.0 * sigma).ceil() as usize;
    let weight = |k: usize| (-0.5 * (k as f64 / sigma.max(1e-9)).powi(2)).exp();
    let sum: f64 = weight(0) + 2.0 * (1..=radius).map(weight).sum::<f64>();
    (0..=radius).map(|k| (weight(k) / sum) as f32).collect()
}

/// Blur along pixels that are `step` apart (1: along rows); outside the image is black.
fn blur(pixels: &[[f32; 3]], width: usize, height: usize, step: usize, kernel: &[f32]) -> Vec<[f32; 3]> {
    let along_rows = step == 1;
    (0..pixels.len())
        .into_par_iter()
        .map(|at| {
            let (place, length) = if along_rows { (at % width, width) } else { (at / width, height) };
            let mut sum = [0.0; 3];
            for (k, weight) in kernel.iter().enumerate() {
                let mut add = |other: usize| (0..3).for_each(|c| sum[c] += weight * pixels[other][c]);
                if place + k < length {
                    add(at + k * step);
                }
                if k > 0 && k <= place {
                    add(at - k * step);
                }
            }
            sum
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bright_pixel_keeps_its_energy_and_spreads_evenly() {
        let mut image = Image::new(101, 101);
        let middle = 50 * 101 + 50;
        image.rgb[middle] = [8.0, 4.0, 2.0];
        let mut source = vec![[0.0; 3]; 101 * 101];
        source[middle] = [4.0, 2.0, 1.0];
        let before = image.rgb.clone();
        add_bloom(&mut image, &source, 0.02);
        let glow: f64 = image.rgb.iter().zip(&before).map(|(a, b)| f64::from(a[0] - b[0])).sum();
        // Rounding of 200 f32 additions.
        assert!((glow - 4.0).abs() < 1e-4, "{glow}");
        assert!((image.rgb[middle - 2][1] - image.rgb[middle + 2 * 101][1]).abs() < 1e-7);
    }

    #[test]
    fn the_glow_is_as_wide_as_it_is_asked_to_be() {
        for sigma in [0.0, 0.01, 0.05] {
            let mut image = Image::new(101, 101);
            let mut source = vec![[0.0; 3]; 101 * 101];
            source[50 * 101 + 50] = [1.0; 3];
            add_bloom(&mut image, &source, sigma);
            let offset = |i: usize| (i % 101) as f64 - 50.0;
            let square: f64 =
                image.rgb.iter().enumerate().map(|(i, rgb)| offset(i).powi(2) * f64::from(rgb[0])).sum();
            // Cut at three standard deviations a Gaussian keeps 0.973 of its variance; the radius is rounded up.
            let whole = (101.0 * sigma).powi(2);
            assert!((0.97 * whole..=1.001 * whole).contains(&square), "{sigma}: {square} of {whole}");
        }
    }
}
