//! Separable filters over planes of numbers, for the metrics.

use rayon::prelude::*;

/// What lies beyond the image's edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Border {
    /// The edge's pixel, repeated.
    Repeat,
    /// Zero.
    Zero,
}

/// Filter N planes at once: plane i with `across[i]` along rows, then `down[i]` along columns.
///
/// `pixels` holds `height x width` pixels, row by row; kernels have an odd, common length. As a
/// correlation: the kernel's first weight meets the pixel furthest left (or up).
pub(super) fn separable<const N: usize>(
    pixels: &[[f64; N]],
    width: usize,
    border: Border,
    across: &[Vec<f64>; N],
    down: &[Vec<f64>; N],
) -> Vec<[f64; N]> {
    let height = pixels.len() / width.max(1);
    let rows =
        pass(pixels, width, across, |x, y, offset| at(x, offset, width, border).map(|x| y * width + x));
    pass(&rows, width, down, |x, y, offset| at(y, offset, height, border).map(|y| y * width + x))
}

/// The place `offset` pixels from `i` on a line of `length`; `None` where that is zero.
fn at(i: usize, offset: isize, length: usize, border: Border) -> Option<usize> {
    match (i.checked_add_signed(offset).filter(|&j| j < length), border) {
        (Some(j), _) => Some(j),
        (None, Border::Zero) => None,
        (None, Border::Repeat) => Some(if offset < 0 { 0 } else { length - 1 }),
    }
}

fn pass<const N: usize>(
    pixels: &[[f64; N]],
    width: usize,
    kernels: &[Vec<f64>; N],
    index: impl Fn(usize, usize, isize) -> Option<usize> + Sync,
) -> Vec<[f64; N]> {
    let length = kernels[0].len();
    let radius = (length / 2) as isize;
    let weights: Vec<[f64; N]> = (0..length).map(|k| std::array::from_fn(|i| kernels[i][k])).collect();
    let mut filtered = vec![[0.0; N]; pixels.len()];
    filtered.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, sum) in row.iter_mut().enumerate() {
            for (k, weight) in weights.iter().enumerate() {
                if let Some(j) = index(x, y, k as isize - radius) {
                    for i in 0..N {
                        sum[i] += weight[i] * pixels[j][i];
                    }
                }
            }
        }
    });
    filtered
}

/// exp(-x^2 / (2 sigma^2)) at whole numbers from -radius to radius, summing to 1.
pub(super) fn gaussian(sigma: f64, radius: usize) -> Vec<f64> {
    let weight = |k: usize| {
        let x = k as f64 - radius as f64;
        (-x * x / (2.0 * sigma * sigma)).exp()
    };
    let weights: Vec<f64> = (0..=2 * radius).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_spreads_into_the_outer_product_of_the_kernels() {
        let mut pixels = vec![[0.0; 1]; 7 * 5];
        pixels[2 * 7 + 3] = [1.0];
        let (across, down) = ([vec![0.25, 0.5, 0.125]], [vec![1.0, 2.0, 3.0]]);
        let spread = separable(&pixels, 7, Border::Zero, &across, &down);
        for (y, x) in (0..5).flat_map(|y| (0..7).map(move |x| (y, x))) {
            // A correlation spreads a point into the mirrored kernels.
            let tap = |kernel: &[f64], i: usize, centre: usize| {
                (centre + 1).checked_sub(i).and_then(|k| kernel.get(k)).copied().unwrap_or(0.0)
            };
            assert_eq!(spread[y * 7 + x][0], tap(&across[0], x, 3) * tap(&down[0], y, 2), "{x} {y}");
        }
    }

    #[test]
    fn borders_repeat_or_vanish() {
        let kernel = [gaussian(1.5, 5)];
        let ones = vec![[1.0]; 6 * 4];
        let repeated = separable(&ones, 6, Border::Repeat, &kernel, &kernel);
        // Eleven products a pass, each rounded.
        assert!(repeated.iter().all(|[v]| (v - 1.0).abs() < 1e-14));
        let vanished = separable(&ones, 6, Border::Zero, &kernel, &kernel);
        assert!(vanished.iter().all(|[v]| *v < 0.99));
    }
}
