//! The bloom that the haze drives: haze-weighted colour, blurred, and added to the image.

use rayon::prelude::*;

use super::image::Image;

/// The blur's standard deviation, as a share of the image's height: about the softness of the
/// paper's pictures.
const SIGMA: f64 = 0.02;

/// Add the Gaussian blur of colour times `haze` (one value a pixel) to the image.
pub fn add_bloom(image: &mut Image, haze: &[f32]) {
    let (width, height) = (image.width, image.height);
    let kernel = kernel(height);
    let hazy: Vec<[f32; 3]> = image.rgb.iter().zip(haze).map(|(rgb, h)| rgb.map(|c| c * h)).collect();
    let across = blur(&hazy, width, height, 1, &kernel);
    let glow = blur(&across, width, height, width, &kernel);
    for (rgb, glow) in image.rgb.iter_mut().zip(glow) {
        for c in 0..3 {
            rgb[c] += glow[c];
        }
    }
}

/// Half of the normalised Gaussian for images of that height, from its middle outwards to three standard
/// deviations.
pub fn kernel(height: usize) -> Vec<f32> {
    let sigma = SIGMA * height as f64;
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
        let mut haze = vec![0.0; 101 * 101];
        haze[middle] = 0.5;
        let before = image.rgb.clone();
        add_bloom(&mut image, &haze);
        let glow: f64 = image.rgb.iter().zip(&before).map(|(a, b)| f64::from(a[0] - b[0])).sum();
        // Rounding of 200 f32 additions.
        assert!((glow - 4.0).abs() < 1e-4, "{glow}");
        assert!((image.rgb[middle - 2][1] - image.rgb[middle + 2 * 101][1]).abs() < 1e-7);
    }
}
