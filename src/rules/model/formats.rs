//! Number formats of graphics processors, emulated: numbers that round as the format does.
//!
//! - [`Half`]: IEEE binary16 after every operation
//! - [`Single`]: IEEE binary32 after every operation
//! - [`Fixed`]: the GeForce FX's 12-bit fixed point after every operation
//! - [`Declared`]: as listing 3-4 declares its variables: `half` for textures and the normal, `fixed` for all
//!   that is light, `float` (not rounded) between the assignments
//! - [`HardwareFilter`], [`NearestTexel`]: exact numbers, but lookups filtered more coarsely
//!
//! Each is the rules' arithmetic with another scalar, [`Emulated`]. Textures are addressed in f64, as texture units
//! have numbers of their own; what a lookup yields is rounded.

use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

use half::f16;

use super::real::Real;

/// The greatest binary16: what would be infinite is held there (MODEL 7).
pub const HALF_MAX: f64 = 65504.0;
/// Steps of the 12-bit fixed point in 1.
const FIXED_STEPS: f64 = 1024.0;

/// The nearest binary16, ties to even; infinite beyond its range.
#[must_use]
pub fn to_half(x: f64) -> f64 {
    f16::from_f64(x).to_f64()
}

/// The nearest 12-bit fixed-point number, ties to even: multiples of 1/1024 in [-2, 2), saturating. What is no
/// number becomes 0.
#[must_use]
pub fn to_fixed(x: f64) -> f64 {
    let x = if x.is_nan() { 0.0 } else { x };
    (x.clamp(-4.0, 4.0) * FIXED_STEPS).round_ties_even().clamp(-2.0 * FIXED_STEPS, 2.0 * FIXED_STEPS - 1.0)
        / FIXED_STEPS
}

/// How a format rounds.
pub trait Format: Copy {
    /// Its name in tables.
    const NAME: &'static str;
    /// The result of any operation.
    #[inline(always)]
    fn round(x: f64) -> f64 {
        x
    }
    /// What is assigned to a variable that the listing declares `half`.
    #[inline(always)]
    fn half(x: f64) -> f64 {
        x
    }
    /// What is assigned to a variable that the listing declares `fixed`.
    #[inline(always)]
    fn fixed(x: f64) -> f64 {
        x
    }
    /// The place between two texels, 0 to 1, as the texture unit has it.
    #[inline(always)]
    fn between(x: f64) -> f64 {
        x
    }
}

macro_rules! format {
    ($(#[$meta:meta])* $name:ident { $($body:tt)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;
        impl Format for $name { $($body)* }
    };
}

format!(
    /// Binary16 after every operation, held within its range.
    Half {
        const NAME: &'static str = "f16";
        fn round(x: f64) -> f64 {
            to_half(x).clamp(-HALF_MAX, HALF_MAX)
        }
    }
);
format!(
    /// Binary32 after every operation.
    Single {
        const NAME: &'static str = "f32";
        fn round(x: f64) -> f64 {
            f64::from(x as f32)
        }
    }
);
format!(
    /// 12-bit fixed point after every operation.
    Fixed {
        const NAME: &'static str = "fixed12";
        fn round(x: f64) -> f64 {
            to_fixed(x)
        }
    }
);
format!(
    /// The types that listing 3-4 declares.
    Declared {
        const NAME: &'static str = "as listed";
        fn half(x: f64) -> f64 {
            to_half(x).clamp(-HALF_MAX, HALF_MAX)
        }
        fn fixed(x: f64) -> f64 {
            to_fixed(x)
        }
    }
);
format!(
    /// Exact numbers; texels are blended with weights of 8 bits, as graphics hardware does.
    HardwareFilter {
        const NAME: &'static str = "8-bit weights";
        fn between(x: f64) -> f64 {
            (x * 256.0).round() / 256.0
        }
    }
);
format!(
    /// Exact numbers; lookups take the nearest texel.
    NearestTexel {
        const NAME: &'static str = "nearest";
        fn between(x: f64) -> f64 {
            x.round()
        }
    }
);

/// A number of format `F`, emulated in f64.
#[derive(Clone, Copy, Debug)]
pub struct Emulated<F>(f64, PhantomData<F>);

impl<F: Format> Emulated<F> {
    /// The nearest number of the format.
    #[must_use]
    #[inline(always)]
    pub fn new(x: f64) -> Self {
        Self(F::round(x), PhantomData)
    }
}

impl<F> From<Emulated<F>> for f64 {
    fn from(number: Emulated<F>) -> Self {
        number.0
    }
}

macro_rules! operator {
    ($trait:ident $method:ident $op:tt) => {
        impl<F: Format> $trait for Emulated<F> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self::new(self.0 $op other.0)
            }
        }
    };
}
operator!(Add add +);
operator!(Sub sub -);
operator!(Mul mul *);
operator!(Div div /);

impl<F: Format> Neg for Emulated<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.0)
    }
}

/// The texture unit's numbers: f64, with the format's filter.
#[derive(Clone, Copy, Debug)]
pub struct Addressed<F>(f64, PhantomData<F>);

macro_rules! as_f64 {
    ($name:ident) => {
        #[inline(always)]
        fn lit(self, value: f64) -> Self {
            Self::new(value)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Self::new(self.0.sqrt())
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(self.0.abs(), PhantomData)
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(self.0.min(other.0), PhantomData)
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(self.0.max(other.0), PhantomData)
        }
        #[inline(always)]
        fn floor(self) -> Self {
            Self(self.0.floor(), PhantomData)
        }
        #[inline(always)]
        fn log2(self) -> Self {
            Self::new(self.0.log2())
        }
        #[inline(always)]
        fn exp2(self) -> Self {
            Self::new(self.0.exp2())
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            self * a + b
        }
        #[inline(always)]
        fn lt(self, other: Self) -> bool {
            self.0 < other.0
        }
        #[inline(always)]
        fn ge(self, other: Self) -> bool {
            self.0 >= other.0
        }
        #[inline(always)]
        fn is_finite(self) -> bool {
            self.0.is_finite()
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
        fn bilinear(texels: &[[f64; 4]], row: usize, index: Self, fx: Self, fy: Self) -> [Self; 4] {
            f64::bilinear(texels, row, index.0, F::between(fx.0), F::between(fy.0)).map(Self::new)
        }
        #[inline(always)]
        fn bilinear_with_slope(
            texels: &[[f64; 4]],
            row: usize,
            index: Self,
            f: [Self; 2],
            d: [Self; 2],
        ) -> ([Self; 4], [Self; 4]) {
            let f = f.map(|f| F::between(f.0));
            let (value, slope) = f64::bilinear_with_slope(texels, row, index.0, f, d.map(|d| d.0));
            (value.map(Self::new), slope.map(Self::new))
        }
        #[inline(always)]
        fn bilinear_with_gradient(
            texels: &[[f64; 4]],
            row: usize,
            index: Self,
            f: [Self; 2],
        ) -> [[Self; 4]; 3] {
            let f = f.map(|f| F::between(f.0));
            f64::bilinear_with_gradient(texels, row, index.0, f).map(|part| part.map(Self::new))
        }
    };
}

impl<F: Format> Real for Emulated<F> {
    type Mask = bool;
    type Texel = f64;
    type Wide = Addressed<F>;

    #[inline(always)]
    fn widen(self) -> Addressed<F> {
        Addressed::new(self.0)
    }
    #[inline(always)]
    fn narrow(wide: Addressed<F>) -> Self {
        Self::new(wide.0)
    }
    #[inline(always)]
    fn half(self) -> Self {
        Self(F::half(self.0), PhantomData)
    }
    #[inline(always)]
    fn fixed(self) -> Self {
        Self(F::fixed(self.0), PhantomData)
    }
    as_f64!(Emulated);
}

impl<F> Addressed<F> {
    #[inline(always)]
    fn new(x: f64) -> Self {
        Self(x, PhantomData)
    }
}

macro_rules! exact_operator {
    ($trait:ident $method:ident $op:tt) => {
        impl<F> $trait for Addressed<F> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self::new(self.0 $op other.0)
            }
        }
    };
}
exact_operator!(Add add +);
exact_operator!(Sub sub -);
exact_operator!(Mul mul *);
exact_operator!(Div div /);

impl<F> Neg for Addressed<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.0)
    }
}

impl<F: Format> Real for Addressed<F> {
    type Mask = bool;
    type Texel = f64;
    type Wide = Self;

    #[inline(always)]
    fn widen(self) -> Self {
        self
    }
    #[inline(always)]
    fn narrow(wide: Self) -> Self {
        wide
    }
    as_f64!(Addressed);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_binary16_and_every_step_of_the_fixed_point_is_kept() {
        for bits in 0..=u16::MAX {
            let x = f16::from_bits(bits).to_f64();
            assert!(to_half(x) == x || x.is_nan());
        }
        for step in -2048..2048 {
            let x = f64::from(step) / 1024.0;
            assert_eq!(to_fixed(x), x);
            // A tie goes to the even neighbour.
            let even = if step % 2 == 0 { step } else { step + 1 };
            assert_eq!(to_fixed(x + 0.5 / 1024.0), f64::from(even.min(2047)) / 1024.0);
        }
    }

    #[test]
    fn nothing_leaves_a_format() {
        assert_eq!(f64::from(Emulated::<Half>::new(60000.0) + Emulated::new(60000.0)), HALF_MAX);
        assert_eq!(f64::from(Emulated::<Fixed>::new(1.5) * Emulated::new(-1.5)), -2.0);
        assert_eq!(f64::from(Emulated::<Fixed>::new(f64::NAN)), 0.0);
        assert_eq!(f64::from(Emulated::<Single>::new(0.1)), f64::from(0.1_f32));
    }
}
