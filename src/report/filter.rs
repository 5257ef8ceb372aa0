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
    let rows = pass(pixels, width, across, |y, offset, weight, sums| {
        let row = &pixels[y * width..(y + 1) * width];
        // Places whose neighbour lies within the row; beyond them stands the edge's pixel, or zero.
        let start = offset.min(0).unsigned_abs().min(width);
        let end = width - offset.max(0).unsigned_abs().min(width - start);
        let from = start.saturating_add_signed(offset).min(width);
        add(&mut sums[start..end], &row[from..from + end - start], weight);
        if border == Border::Repeat {
            sums[..start].iter_mut().for_each(|sum| add_pixel(sum, &row[0], weight));
            sums[end..].iter_mut().for_each(|sum| add_pixel(sum, &row[width - 1], weight));
        }
    });
    pass(&rows, width, down, |y, offset, weight, sums| {
        if let Some(y) = at(y, offset, height, border) {
            add(sums, &rows[y * width..(y + 1) * width], weight);
        }
    })
}

/// The place `offset` pixels from `i` on a line of `length`; `None` where that is zero.
fn at(i: usize, offset: isize, length: usize, border: Border) -> Option<usize> {
    match (i.checked_add_signed(offset).filter(|&j| j < length), border) {
        (Some(j), _) => Some(j),
        (None, Border::Zero) => None,
        (None, Border::Repeat) => Some(if offset < 0 { 0 } else { length - 1 }),
    }
}

/// Add up the taps of each row, one after the other: `tap` adds one, given the row, the tap's offset and its weights.
fn pass<const N: usize>(
    pixels: &[[f64; N]],
    width: usize,
    kernels: &[Vec<f64>; N],
    tap: impl Fn(usize, isize, &[f64; N], &mut [[f64; N]]) + Sync,
) -> Vec<[f64; N]> {
    let length = kernels[0].len();
    let radius = (length / 2) as isize;
    let mut filtered = vec![[0.0; N]; pixels.len()];
    filtered.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, sums)| {
        for k in 0..length {
            tap(y, k as isize - radius, &std::array::from_fn(|i| kernels[i][k]), sums);
        }
    });
    filtered
}

/// Add `weight` times each pixel to its sum.
fn add<const N: usize>(sums: &mut [[f64; N]], pixels: &[[f64; N]], weight: &[f64; N]) {
    for (sum, pixel) in sums.iter_mut().zip(pixels) {
        add_pixel(sum, pixel, weight);
    }
}

#[inline(always)]
fn add_pixel<const N: usize>(sum: &mut [f64; N], pixel: &[f64; N], weight: &[f64; N]) {
    for i in 0..N {
        sum[i] += weight[i] * pixel[i];
    }
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

    /// Pixel by pixel, as the sum is written.
    fn by_pixels<const N: usize>(
        pixels: &[[f64; N]],
        width: usize,
        border: Border,
        kernels: [&[Vec<f64>; N]; 2],
    ) -> Vec<[f64; N]> {
        let height = pixels.len() / width;
        let along = |pixels: &[[f64; N]], kernels: &[Vec<f64>; N], vertical: bool| -> Vec<[f64; N]> {
            let sum = |place: usize| {
                let (x, y) = (place % width, place / width);
                let mut sum = [0.0; N];
                for k in 0..kernels[0].len() {
                    let offset = k as isize - (kernels[0].len() / 2) as isize;
                    let found = match vertical {
                        false => at(x, offset, width, border).map(|x| y * width + x),
                        true => at(y, offset, height, border).map(|y| y * width + x),
                    };
                    found.into_iter().for_each(|j| {
                        (0..N).for_each(|i| sum[i] += kernels[i][k] * pixels[j][i]);
                    });
                }
                sum
            };
            (0..pixels.len()).map(sum).collect()
        };
        along(&along(pixels, kernels[0], false), kernels[1], true)
    }

    #[test]
    fn rows_at_once_give_what_pixels_one_by_one_give_to_the_bit() {
        let number = |i: usize| ((i * 7919) % 1009) as f64 / 1009.0 - 0.4;
        let kernel = |from: usize, length: usize| (0..length).map(|k| number(from + k)).collect::<Vec<f64>>();
        for width in 1..8 {
            let pixels: Vec<[f64; 2]> = (0..5 * width).map(|i| [number(i), number(i + 400)]).collect();
            // Longer than lines, too.
            for length in [1, 3, 5, 9, 15, 21] {
                let across = [kernel(3, length), kernel(50, length)];
                let down = [kernel(90, length), kernel(130, length)];
                for border in [Border::Repeat, Border::Zero] {
                    let found = separable(&pixels, width, border, &across, &down);
                    assert!(found == by_pixels(&pixels, width, border, [&across, &down]), "{width} {length}");
                }
            }
        }
        let one = [vec![1.0]];
        assert!(separable(&[], 0, Border::Repeat, &one, &one).is_empty());
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
