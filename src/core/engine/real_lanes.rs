//! f32 lanes side by side as one [`Real`]: its powers, comparisons, and lookups.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x8, i32x16, mask32x8, mask32x16};

use super::corners::Lookup;
use super::lanes::{HalfLanes, Lanes};
use crate::model::real::Real;
use crate::simd::Simd;

macro_rules! real {
    ($lanes:ident, $float:ident, $int:ident, $mask:ident) => {
        impl<S: Simd> Real for $lanes<S> {
            type Mask = $mask<S>;
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
                let bits: $int<S> = self.0.to_bits().bitcast();
                // 0x3f3504f3 is sqrt(1/2): the mantissa is taken from [sqrt(1/2), sqrt(2)).
                let shifted = bits - self.int(0x3f35_04f3);
                let exponent = shifted >> 23;
                let mantissa: $float<S> = (bits - (exponent << 23)).bitcast();
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
                let whole: $int<S> = whole.0.to_int();
                let power: $float<S> = ((whole + self.int(127)) << 23).bitcast();
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
                let sides = index.blended_rows(texels, row, fy);
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
                let corners = index.corners(texels, row);
                for channel in 0..4 {
                    let [value, across, down] = corners.with_gradient(channel, [fx, fy]);
                    values[channel] = value;
                    slopes[channel] = dx.mul_add(across, dy * down);
                }
                (Self::made_here(values), Self::made_here(slopes))
            }

            #[inline(always)]
            fn bilinear_with_gradient(
                texels: &[[f32; 4]],
                row: usize,
                index: Self,
                [fx, fy]: [Self; 2],
            ) -> [[Self; 4]; 3] {
                let mut parts = [[fx; 4]; 3];
                let corners = index.corners(texels, row);
                for channel in 0..4 {
                    let [value, across, down] = corners.with_gradient(channel, [fx, fy]);
                    (parts[0][channel], parts[1][channel], parts[2][channel]) = (value, across, down);
                }
                parts
            }
        }
    };
}

real!(Lanes, f32x16, i32x16, mask32x16);
real!(HalfLanes, f32x8, i32x8, mask32x8);

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

    /// What a row's halves yield is what the row does, to the bit.
    #[inline(always)]
    fn halves_are_the_row<S: Simd>(simd: S) {
        let texels: Vec<[f32; 4]> =
            (0..90).map(|i| [0, 1, 2, 3].map(|c| ((7 * i + c) % 23) as f32)).collect();
        let row: [[f32; LANES]; 3] = [
            std::array::from_fn(|lane| (5 * lane % 77) as f32),
            std::array::from_fn(|lane| lane as f32 / 17.0),
            std::array::from_fn(|lane| 1.0 - lane as f32 / 19.0),
        ];
        let [index, fx, fy] = row.map(|row| Lanes(f32x16::load_array(simd, row)));
        let whole = [
            Lanes::bilinear(&texels, 10, index, fx, fy),
            Lanes::bilinear_with_slope(&texels, 10, index, [fx, fy], [fy, fx]).1,
            Lanes::bilinear_with_gradient(&texels, 10, index, [fx, fy])[2],
            [fx.log2(), fx.exp2(), fy.recip(), fy.floor()],
        ];
        for half in 0..2 {
            let part = |row: &[f32; LANES]| HalfLanes::of_row(simd, &row.as_chunks().0[half]);
            let [index, fx, fy] = [part(&row[0]), part(&row[1]), part(&row[2])];
            let halves = [
                HalfLanes::bilinear(&texels, 10, index, fx, fy),
                HalfLanes::bilinear_with_slope(&texels, 10, index, [fx, fy], [fy, fx]).1,
                HalfLanes::bilinear_with_gradient(&texels, 10, index, [fx, fy])[2],
                [fx.log2(), fx.exp2(), fy.recip(), fy.floor()],
            ];
            for (whole, halves) in whole.iter().flatten().zip(halves.iter().flatten()) {
                let bits = |numbers: &[f32]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                let (own, whole) = (halves.to_array(), whole.to_array());
                assert_eq!(bits(&own), bits(&whole[8 * half..][..8]));
            }
        }
    }

    #[test]
    fn halves_compute_what_rows_do() {
        for level in levels() {
            with_simd!(level, simd => halves_are_the_row(simd));
        }
    }
}
