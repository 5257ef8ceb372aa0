//! The inner loop of the prefilter: the lobe's mean over cells, sixteen at a time.
//!
//! With X = r.w over a cell, the mean of k(X) is k(m) + k''(m) v / 2 to second order, where the mean m
//! of X is r times the cell's mean direction, and its variance v is a twelfth of the solid angle times
//! the squared sine. For X^e that is m^e + e (e-1) / 2 m^(e-2) v. The lobes of BRDFs are
//! [`Radial`](super::radial::Radial)'s, of u = 1 - X.

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

/// A lobe, as the kernel weighs cells with it.
pub(super) trait Weigh: Copy + Sync {
    /// Its mean over sixteen cells; `fall` is 1 - r.m.
    fn mean<S: Simd>(self, simd: S, fall: f32x16<S>, solid_angle: f32x16<S>) -> f32x16<S>;
}

/// A Phong lobe.
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

impl Weigh for Lobe {
    #[inline(always)]
    fn mean<S: Simd>(self, simd: S, fall: f32x16<S>, solid_angle: f32x16<S>) -> f32x16<S> {
        let lit = |x: f32| f32x16::splat(simd, x);
        let cosine = (lit(1.0) - fall).max(lit(1e-30));
        let log2 = log2_of_one_minus(simd, fall, cosine);
        let power = exp2(simd, log2 * lit(self.exponent - 2.0));
        let variance = solid_angle * lit(self.curvature);
        let sine_squared = fall * (lit(2.0) - fall);
        power * cosine.mul_add(cosine, variance * sine_squared)
    }
}

/// Kelemen's lobe: g(t) = exp(-t / m^2) (1 - t) (1 + t)^2 of t = u / (2 - u).
#[derive(Clone, Copy)]
pub(super) struct Kelemen {
    /// 1 / m^2.
    steepness: f32,
}

impl Kelemen {
    pub(super) fn new(m: f64) -> Self {
        Self { steepness: (1.0 / (m * m)) as f32 }
    }
}

impl Weigh for Kelemen {
    #[inline(always)]
    fn mean<S: Simd>(self, simd: S, fall: f32x16<S>, solid_angle: f32x16<S>) -> f32x16<S> {
        let lit = |x: f32| f32x16::splat(simd, x);
        let (one, steep) = (lit(1.0), lit(self.steepness));
        let u = fall.min(one);
        let t = u / (lit(2.0) - u);
        let above = one + t;
        let power = exp2(simd, t * lit(-self.steepness * std::f32::consts::LOG2_E));
        // g = power h; its derivatives by t, over power.
        let h = (one - t) * above * above;
        let h_slope = above * (one - lit(3.0) * t);
        let slope = h_slope - steep * h;
        let bend = steep * (steep * h - lit(2.0) * h_slope) - lit(6.0).mul_add(t, lit(2.0));
        // t' = (1 + t)^2 / 2 and t'' = (1 + t)^3 / 2 by u.
        let cube = above * above * above;
        let curvature = cube * (lit(0.25) * above * bend + lit(0.5) * slope);
        let variance = solid_angle * u * (lit(2.0) - u) * lit(1.0 / 24.0);
        let mean = power * curvature.mul_add(variance, h);
        fall.simd_lt(one).select(mean, lit(0.0))
    }
}

/// The lobe of GGX: masking times 1 / (1 + sharpness u)^2.
#[derive(Clone, Copy)]
pub(super) struct Ggx {
    /// alpha^2.
    alpha_squared: f32,
    /// (1 - alpha^2) / (2 alpha^2).
    sharpness: f32,
}

impl Ggx {
    pub(super) fn new(m: f64) -> Self {
        let a2 = m.powi(4);
        Self { alpha_squared: a2 as f32, sharpness: ((1.0 - a2) / (2.0 * a2)) as f32 }
    }
}

impl Weigh for Ggx {
    #[inline(always)]
    fn mean<S: Simd>(self, simd: S, fall: f32x16<S>, solid_angle: f32x16<S>) -> f32x16<S> {
        let lit = |x: f32| f32x16::splat(simd, x);
        let (one, a2, sharp) = (lit(1.0), lit(self.alpha_squared), lit(self.sharpness));
        let u = fall.min(one);
        let cosine = one - u;
        let root = ((one - a2) * cosine).mul_add(cosine, a2).sqrt();
        let both = cosine + root;
        // The masking and its slope by u; its own curvature moves nothing.
        let masking = lit(2.0) * cosine / both;
        let slope = lit(-2.0) * a2 / (root * both * both);
        let inverse = one / sharp.mul_add(u, one);
        let steep = sharp * inverse;
        let curvature = steep * (lit(6.0) * masking * steep - lit(4.0) * slope);
        let variance = solid_angle * u * (lit(2.0) - u) * lit(1.0 / 24.0);
        let mean = inverse * inverse * curvature.mul_add(variance, masking);
        fall.simd_lt(one).select(mean, lit(0.0))
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
    lobe: impl Weigh,
) -> [f64; 4] {
    let r = r.map(|x| f32x16::splat(simd, x as f32));
    let mut sums = [f64x8::splat(simd, 0.0); 4];
    for block in blocks {
        let mut partial = [f32x16::splat(simd, 0.0); 4];
        for cells in block {
            let solid_angle = f32x16::from_slice(simd, &cells.solid_angle);
            let weight = lobe.mean(simd, fall(simd, cells, r), solid_angle);
            partial[0] += weight * solid_angle;
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

/// t = 1 - r.m of each cell.
#[inline(always)]
fn fall<S: Simd>(simd: S, cells: &Cells, r: [f32x16<S>; 3]) -> f32x16<S> {
    // shortness + |r - m|^2 / 2: near the lobe's axis, where a high power asks for it, this is far more
    // precise than the dot product.
    let half = f32x16::splat(simd, 0.5);
    let mut t = f32x16::from_slice(simd, &cells.shortness);
    for i in 0..3 {
        let d = r[i] - f32x16::from_slice(simd, &cells.mean_direction[i]);
        t = (d * half).mul_add(d, t);
    }
    t
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
