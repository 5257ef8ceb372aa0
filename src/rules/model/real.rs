//! What is asked of a number. The rules' operations run on any [`Real`]; f32 and f64 stand here, SIMD lanes in the
//! engine, reduced number formats in [`super::formats`].

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number, or a vector of lanes that each hold one.
///
/// Branches are written as [`Real::select`], so that lanes can differ. Constants come from a value
/// at hand ([`Real::lit`]), because lanes may carry a token of the processor's abilities.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The outcome of a comparison, lane by lane.
    type Mask: Copy;
    /// What a texel's channel is stored as.
    type Texel: Copy;
    /// What textures are addressed with: a reduced format has too few numbers for that.
    type Wide: Real<Texel = Self::Texel>;

    /// This number as an address.
    fn widen(self) -> Self::Wide;
    /// What a lookup yields, as a number of this kind.
    fn narrow(wide: Self::Wide) -> Self;
    /// As assigned to a variable that the listing declares `half`.
    #[inline(always)]
    fn half(self) -> Self {
        self
    }
    /// As assigned to a variable that the listing declares `fixed`.
    #[inline(always)]
    fn fixed(self) -> Self {
        self
    }

    /// The constant `value`, in as many lanes as `self`.
    fn lit(self, value: f64) -> Self;
    /// 1 / `self` for a number whose size is between 1e-37 and 1e37, to within two roundings.
    #[inline(always)]
    fn recip(self) -> Self {
        self.lit(1.0) / self
    }
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The smaller; unspecified when either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; unspecified when either is NaN.
    fn max(self, other: Self) -> Self;
    /// The greatest integer not above.
    fn floor(self) -> Self;
    /// Base-2 logarithm of a positive, normal number.
    fn log2(self) -> Self;
    /// 2 to the power of `self`; 0 on underflow.
    fn exp2(self) -> Self;
    /// `self * a + b`, in one rounding where the hardware has it.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self >= other`.
    fn ge(self, other: Self) -> Self::Mask;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> Self::Mask;
    /// Both.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// `yes` where `mask` holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Whether the mask holds in every lane.
    fn all(mask: Self::Mask) -> bool;

    /// The bilinear blend of 2 x 2 texels at (`fx`, `fy`) in [0, 1]^2. `index` (an integer) is the
    /// first texel; the others are its right neighbour, the one `row` below, and that one's right
    /// neighbour. Indices must lie in `texels`.
    fn bilinear(texels: &[[Self::Texel; 4]], row: usize, index: Self, fx: Self, fy: Self) -> [Self; 4];

    /// As [`Real::bilinear`], with the blend's derivative as (fx, fy) moves along (`dx`, `dy`).
    fn bilinear_with_slope(
        texels: &[[Self::Texel; 4]],
        row: usize,
        index: Self,
        f: [Self; 2],
        d: [Self; 2],
    ) -> ([Self; 4], [Self; 4]);

    /// As [`Real::bilinear`], with the blend's derivatives by `fx` and by `fy`.
    fn bilinear_with_gradient(
        texels: &[[Self::Texel; 4]],
        row: usize,
        index: Self,
        f: [Self; 2],
    ) -> [[Self; 4]; 3];
}

/// `yes` where `mask` holds, else `no`: [`Real::select`] of numbers whose kind is plain.
#[inline(always)]
pub fn select<R: Real>(mask: R::Mask, yes: R, no: R) -> R {
    R::select(mask, yes, no)
}

macro_rules! real_for_float {
    ($float:ident) => {
        impl Real for $float {
            type Mask = bool;
            type Texel = $float;
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
            #[allow(clippy::cast_possible_truncation, trivial_numeric_casts, reason = "rounds to the scalar")]
            fn lit(self, value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.min(other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }
            #[inline(always)]
            fn floor(self) -> Self {
                self.floor()
            }
            #[inline(always)]
            fn log2(self) -> Self {
                self.log2()
            }
            #[inline(always)]
            fn exp2(self) -> Self {
                self.exp2()
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                // Not fused: without the instruction, the library call is 20 times slower.
                self * a + b
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn ge(self, other: Self) -> bool {
                self >= other
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
            #[inline(always)]
            fn and(a: bool, b: bool) -> bool {
                a && b
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn all(mask: bool) -> bool {
                mask
            }
            #[inline(always)]
            fn bilinear(texels: &[[Self; 4]], row: usize, index: Self, fx: Self, fy: Self) -> [Self; 4] {
                Self::bilinear_with_slope(texels, row, index, [fx, fy], [0.0, 0.0]).0
            }
            #[inline(always)]
            fn bilinear_with_slope(
                texels: &[[Self; 4]],
                row: usize,
                index: Self,
                [fx, fy]: [Self; 2],
                [dx, dy]: [Self; 2],
            ) -> ([Self; 4], [Self; 4]) {
                let i = index as usize;
                let (top, bottom) = (&texels[i..i + 2], &texels[i + row..i + row + 2]);
                let (gx, gy) = (1.0 - fx, 1.0 - fy);
                let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
                for channel in 0..4 {
                    let [a, b] = [top[0][channel], top[1][channel]];
                    let [c, d] = [bottom[0][channel], bottom[1][channel]];
                    let (upper, lower) = (a * gx + b * fx, c * gx + d * fx);
                    value[channel] = upper * gy + lower * fy;
                    slope[channel] = dx * ((b - a) * gy + (d - c) * fy) + dy * (lower - upper);
                }
                (value, slope)
            }
            #[inline(always)]
            fn bilinear_with_gradient(
                texels: &[[Self; 4]],
                row: usize,
                index: Self,
                f: [Self; 2],
            ) -> [[Self; 4]; 3] {
                let (value, across) = Self::bilinear_with_slope(texels, row, index, f, [1.0, 0.0]);
                let (_, down) = Self::bilinear_with_slope(texels, row, index, f, [0.0, 1.0]);
                [value, across, down]
            }
        }
    };
}

real_for_float!(f32);
real_for_float!(f64);
