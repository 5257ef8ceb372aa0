//! Sixteen f32 lanes as one [`Real`]: its powers, comparisons, and lookups.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, mask32x16};

use super::corners::{Corners, blended_rows, made_here};
use super::lanes::Lanes;
use crate::model::real::Real;
use crate::simd::Simd;

impl<S: Simd> Real for Lanes<S> {
    type Mask = mask32x16<S>;
    type Texel = f32;
    type Wide = Self;

    #[inline(always)]
    fn widen(self) -> Self {
        self
    }
    #[inline(always)]
    fn narrow(wide: Self) -> Self {
        wide
    }
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "rounds to the scalar")]
    fn lit(self, value: f64) -> Self {
        Self::splat(self.0.simd, value as f32)
    }
    /// The processor's estimate, refined once: a division occupies the divider for 16 cycles.
    #[inline(always)]
    fn recip(self) -> Self {
        let estimate = Self(self.0.approximate_recip());
        let error = (-self).mul_add(estimate, self.lit(1.0));
        error.mul_add(estimate, estimate)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.floor())
    }

    /// By the exponent's bits and the series of artanh; within 2e-7 absolute.
    #[inline(always)]
    fn log2(self) -> Self {
        let bits: i32x16<S> = self.0.to_bits().bitcast();
        // 0x3f3504f3 is sqrt(1/2): the mantissa is taken from [sqrt(1/2), sqrt(2)).
        let shifted = bits - self.int(0x3f35_04f3);
        let exponent = shifted >> 23;
        let mantissa: f32x16<S> = (bits - (exponent << 23)).bitcast();
        let m = Self(mantissa);
        let one = self.lit(1.0);
        let t = (m - one) * (m + one).recip();
        let t2 = t * t;
        // log2 m = 2 / ln 2 (t + t^3/3 + t^5/5 + ...), |t| < 0.172
        let k = 2.0 / std::f64::consts::LN_2;
        let series = t2
            .mul_add(self.lit(k / 9.0), self.lit(k / 7.0))
            .mul_add(t2, self.lit(k / 5.0))
            .mul_add(t2, self.lit(k / 3.0))
            .mul_add(t2, self.lit(k));
        series.mul_add(t, Self(exponent.to_float()))
    }

    /// By the nearest integer and Taylor's polynomial of degree 7; within 2e-7 relative.
    #[inline(always)]
    fn exp2(self) -> Self {
        let underflow = self.lit(-126.0);
        let clamped = self.max(underflow).min(self.lit(127.0));
        let whole = (clamped + self.lit(0.5)).floor();
        let f = clamped - whole;
        let mut coefficients = [1.0_f64; 8];
        for k in 1..8 {
            coefficients[k] = coefficients[k - 1] * std::f64::consts::LN_2 / k as f64;
        }
        let mut value = self.lit(coefficients[7]);
        for k in (0..7).rev() {
            value = value.mul_add(f, self.lit(coefficients[k]));
        }
        let whole: i32x16<S> = whole.0.to_int();
        let power: f32x16<S> = ((whole + self.int(127)) << 23).bitcast();
        Self::select(self.ge(underflow), value * Self(power), self.lit(0.0))
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_add(a.0, b.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.0.simd_lt(other.0)
    }
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        self.0.simd_ge(other.0)
    }
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        // NaN fails the comparison too.
        self.abs().0.simd_le(self.lit(f64::from(f32::MAX)).0)
    }
    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        a & b
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(mask.select(yes.0, no.0))
    }

    #[inline(always)]
    fn all(mask: Self::Mask) -> bool {
        mask.all_true()
    }

    #[inline(always)]
    fn bilinear(texels: &[[f32; 4]], row: usize, index: Self, fx: Self, fy: Self) -> [Self; 4] {
        let mut values = [fx; 4];
        let sides = blended_rows(texels, row, index, fy);
        for channel in 0..4 {
            let [left, right] = sides[channel];
            values[channel] = fx.mul_add(right - left, left);
        }
        values
    }

    #[inline(always)]
    fn bilinear_with_slope(
        texels: &[[f32; 4]],
        row: usize,
        index: Self,
        [fx, fy]: [Self; 2],
        [dx, dy]: [Self; 2],
    ) -> ([Self; 4], [Self; 4]) {
        let (mut values, mut slopes) = ([fx; 4], [fx; 4]);
        let corners = Corners::load(texels, row, index);
        for channel in 0..4 {
            let [value, across, down] = corners.with_gradient(channel, [fx, fy]);
            values[channel] = value;
            slopes[channel] = dx.mul_add(across, dy * down);
        }
        (made_here(values), made_here(slopes))
    }

    #[inline(always)]
    fn bilinear_with_gradient(
        texels: &[[f32; 4]],
        row: usize,
        index: Self,
        [fx, fy]: [Self; 2],
    ) -> [[Self; 4]; 3] {
        let mut parts = [[fx; 4]; 3];
        let corners = Corners::load(texels, row, index);
        for channel in 0..4 {
            let [value, across, down] = corners.with_gradient(channel, [fx, fy]);
            (parts[0][channel], parts[1][channel], parts[2][channel]) = (value, across, down);
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::LANES;
    use crate::simd::{levels, name};
    use crate::with_simd;

    #[inline(always)]
    fn worst_errors<S: Simd>(simd: S) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        for i in 0..4000 {
            let x: [f32; LANES] =
                std::array::from_fn(|lane| (0.004 * (i * LANES + lane) as f32 - 120.0).exp2());
            let y: [f32; LANES] = std::array::from_fn(|lane| -0.002 * (i * LANES + lane) as f32);
            let log = Lanes(f32x16::load_array(simd, x)).log2().0.to_array();
            let exp = Lanes(f32x16::load_array(simd, y)).exp2().0.to_array();
            for lane in 0..LANES {
                let want = f64::from(x[lane]).log2();
                worst[0] = worst[0].max((f64::from(log[lane]) - want).abs() / want.abs().max(1.0));
                let want = f64::from(y[lane]).exp2();
                if y[lane] >= -126.0 {
                    worst[1] = worst[1].max((f64::from(exp[lane]) - want).abs() / want);
                }
            }
        }
        worst
    }

    #[test]
    fn logarithm_and_power_are_within_two_units_in_the_last_place() {
        for level in levels() {
            let [log, exp] = with_simd!(level, simd => worst_errors(simd));
            // An f32 has 6e-8 of relative rounding; each function rounds a few times.
            assert!(log < 2.4e-7, "{}: log2: {log}", name(level));
            assert!(exp < 2.4e-7, "{}: exp2: {exp}", name(level));
        }
    }
}
