//! The inner loop of the prefilter: the lobe's mean over cells, sixteen at a time.
//!
//! With X = r.w over a cell, the mean of X^e is m^e + e (e-1) / 2 m^(e-2) v to second order, where
//! the mean m of X is r times the cell's mean direction, and its variance v is a twelfth of the
//! solid angle times the squared sine.

use fearless_simd::{Simd, f32x16, f64x8, i32x16, prelude::*};

use super::pyramid::Cell;

/// Cells in a SIMD vector.
pub(super) const WIDE: usize = 16;
/// SIMD vectors in a block: cells that are culled together.
pub(super) const BLOCK: usize = 4;

/// Sixteen cells, a vector a quantity.
#[derive(Clone, Copy)]
pub(super) struct Cells {
    /// Mean of the unit direction over the cell (shorter than 1).
    mean_direction: [[f32; WIDE]; 3],
    /// (1 - |mean direction|^2) / 2, kept by itself for its precision.
    shortness: [f32; WIDE],
    solid_angle: [f32; WIDE],
    /// Flux beyond the environment's mean radiance.
    flux: [[f32; WIDE]; 3],
}

/// What the kernel needs beside the cells.
#[derive(Clone, Copy)]
pub(super) struct Lobe {
    exponent: f32,
    /// e (e-1) / 24, the second-order term's factor.
    curvature: f32,
}

impl Lobe {
    pub(super) fn new(exponent: f64) -> Self {
        // Below exponent 4 the kink at the horizon, not the curvature, limits the accuracy.
        let curvature = if exponent < 4.0 { 0.0 } else { exponent * (exponent - 1.0) / 24.0 };
        Self { exponent: exponent as f32, curvature: curvature as f32 }
    }
}

impl Cells {
    /// The first sixteen of `cells`; what is missing counts nothing.
    pub(super) fn pack(cells: &[Cell], mean: [f32; 3]) -> Self {
        let zero = [0.0; WIDE];
        let mut packed =
            Self { mean_direction: [zero; 3], shortness: zero, solid_angle: zero, flux: [zero; 3] };
        for (i, cell) in cells.iter().take(WIDE).enumerate() {
            let direction = cell.moment.map(|m| m / cell.solid_angle);
            let length_squared: f64 = direction.iter().map(|x| x * x).sum();
            packed.shortness[i] = (0.5 * (1.0 - length_squared)) as f32;
            packed.solid_angle[i] = cell.solid_angle as f32;
            for c in 0..3 {
                packed.mean_direction[c][i] = direction[c] as f32;
                packed.flux[c][i] = (cell.flux[c] - f64::from(mean[c]) * cell.solid_angle) as f32;
            }
        }
        packed
    }
}

/// The sums of weight and of weighted flux (three channels) over `blocks`, for a lobe about `r`.
#[inline(always)]
pub(super) fn gather<'a, S: Simd>(
    simd: S,
    blocks: impl Iterator<Item = &'a [Cells; BLOCK]>,
    r: [f64; 3],
    lobe: Lobe,
) -> [f64; 4] {
    let r = r.map(|x| f32x16::splat(simd, x as f32));
    let mut sums = [f64x8::splat(simd, 0.0); 4];
    for block in blocks {
        let mut partial = [f32x16::splat(simd, 0.0); 4];
        for cells in block {
            let weight = weights(simd, cells, r, lobe);
            partial[0] += weight * f32x16::from_slice(simd, &cells.solid_angle);
            for c in 0..3 {
                partial[c + 1] = weight.mul_add(f32x16::from_slice(simd, &cells.flux[c]), partial[c + 1]);
            }
        }
        for (sum, partial) in sums.iter_mut().zip(partial) {
            let (low, high) = simd.widen_f32x16(partial);
            *sum += low + high;
        }
    }
    sums.map(|sum| sum.as_slice().iter().sum())
}

/// The mean of max(r.w, 0)^e over each cell.
#[inline(always)]
fn weights<S: Simd>(simd: S, cells: &Cells, r: [f32x16<S>; 3], lobe: Lobe) -> f32x16<S> {
    let lit = |x: f32| f32x16::splat(simd, x);
    // t = 1 - r.m = shortness + |r - m|^2 / 2: near the lobe's axis, where a high power asks for
    // it, this is far more precise than the dot product.
    let half = lit(0.5);
    let mut t = f32x16::from_slice(simd, &cells.shortness);
    for i in 0..3 {
        let d = r[i] - f32x16::from_slice(simd, &cells.mean_direction[i]);
        t = (d * half).mul_add(d, t);
    }
    let one = lit(1.0);
    let cosine = (one - t).max(lit(1e-30));
    let log2 = log2_of_one_minus(simd, t, cosine);
    let power = exp2(simd, log2 * lit(lobe.exponent - 2.0));
    let variance = f32x16::from_slice(simd, &cells.solid_angle) * lit(lobe.curvature);
    let sine_squared = t * (lit(2.0) - t);
    power * cosine.mul_add(cosine, variance * sine_squared)
}

/// log2(1 - t), given also `cosine` = 1 - t > 0, to a few units in the last place.
#[inline(always)]
fn log2_of_one_minus<S: Simd>(simd: S, t: f32x16<S>, cosine: f32x16<S>) -> f32x16<S> {
    let lit = |x: f32| f32x16::splat(simd, x);
    // cosine = 2^n m with m in [sqrt(1/2), sqrt(2)).
    let bits: i32x16<S> = cosine.bitcast();
    let n = (bits - i32x16::splat(simd, std::f32::consts::FRAC_1_SQRT_2.to_bits() as i32)) >> 23;
    let m: f32x16<S> = (bits - (n << 23)).bitcast();
    let near = n.simd_eq(i32x16::splat(simd, 0));
    let f = near.select(-t, m - lit(1.0));
    // ln(1 + f) = 2 artanh(f / (2 + f)).
    let s = f / (f + lit(2.0));
    let s2 = s * s;
    let series = s2.mul_add(lit(1.0 / 9.0), lit(1.0 / 7.0)).mul_add(s2, lit(0.2));
    let series = series.mul_add(s2, lit(1.0 / 3.0)).mul_add(s2, lit(1.0));
    let n = simd.cvt_f32_i32x16(n);
    (s * series).mul_add(lit(2.0 * std::f32::consts::LOG2_E), n)
}

/// 2^y, 0 far below. The polynomial is Cephes' `exp2f`.
#[inline(always)]
fn exp2<S: Simd>(simd: S, y: f32x16<S>) -> f32x16<S> {
    let lit = |x: f32| f32x16::splat(simd, x);
    let y = y.max(lit(-126.0)).min(lit(127.0));
    let n = y.round_ties_even();
    let f = y - n;
    let coefficients = [
        1.535_336_2e-4,
        1.339_887_4e-3,
        9.618_437e-3,
        5.550_332_5e-2,
        2.402_264_8e-1,
        std::f32::consts::LN_2,
        1.0,
    ];
    let mut p = lit(coefficients[0]);
    for c in &coefficients[1..] {
        p = p.mul_add(f, lit(*c));
    }
    let exponent = simd.cvt_i32_f32x16(n) + i32x16::splat(simd, 127);
    let scale: f32x16<S> = (exponent << 23).bitcast();
    p * scale
}
