//! Sixteen f32 lanes as one number, on whatever SIMD the processor has; `real_lanes` has its functions.
//!
//! The width is fixed, so that results are the same whichever instructions run (up to the fused
//! multiply-add, which SSE2 lacks).

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};

use crate::samples::LANES;
use crate::simd::Simd;

/// [`LANES`] numbers in one register (or two, or four).
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd>(pub f32x16<S>);

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<S: Simd> std::ops::$trait for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<S: Simd> std::ops::Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl<S: Simd> Lanes<S> {
    /// `value` in every lane.
    #[inline(always)]
    pub fn splat(simd: S, value: f32) -> Self {
        Self(f32x16::splat(simd, value))
    }

    /// The lanes' values.
    #[inline(always)]
    #[must_use]
    pub fn to_array(self) -> [f32; LANES] {
        self.0.to_array()
    }

    /// The values of a row.
    #[inline(always)]
    pub fn of_row(simd: S, row: &[f32; LANES]) -> Self {
        Self(f32x16::load_array_ref(simd, row))
    }

    /// Store into a row.
    #[inline(always)]
    pub fn store(self, row: &mut [f32; LANES]) {
        self.0.store_array(row);
    }

    #[inline(always)]
    pub(super) fn int(self, value: i32) -> i32x16<S> {
        i32x16::splat(self.0.simd, value)
    }
}
