//! f32 lanes side by side as one number, on whatever SIMD the processor has; `real_lanes` has their functions.
//!
//! A row of samples has sixteen, so that results are the same whichever instructions run (up to the fused
//! multiply-add, which SSE2 lacks). Where a register holds fewer, functions with a loop compute a row by its halves: a number
//! then takes half as many of the few registers.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x8, i32x16};

use crate::samples::LANES;
use crate::simd::Simd;

/// [`LANES`] numbers in one register (or two, or four).
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd>(pub f32x16<S>);

/// Half of a row's numbers.
#[derive(Clone, Copy)]
pub struct HalfLanes<S: Simd>(pub f32x8<S>);

/// Numbers of a half of a row.
pub(super) const HALF: usize = LANES / 2;

macro_rules! operator {
    ($lanes:ident, $trait:ident, $method:ident) => {
        impl<S: Simd> std::ops::$trait for $lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
    };
}

macro_rules! lanes {
    ($lanes:ident, $count:expr, $float:ident, $int:ident) => {
        operator!($lanes, Add, add);
        operator!($lanes, Sub, sub);
        operator!($lanes, Mul, mul);
        operator!($lanes, Div, div);

        impl<S: Simd> std::ops::Neg for $lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }

        impl<S: Simd> $lanes<S> {
            /// `value` in every lane.
            #[inline(always)]
            pub fn splat(simd: S, value: f32) -> Self {
                Self($float::splat(simd, value))
            }

            /// The lanes' values.
            #[inline(always)]
            #[must_use]
            pub fn to_array(self) -> [f32; $count] {
                self.0.to_array()
            }

            /// The values of a row, or of its half.
            #[inline(always)]
            pub fn of_row(simd: S, row: &[f32; $count]) -> Self {
                Self($float::load_array_ref(simd, row))
            }

            /// Store into a row, or its half.
            #[inline(always)]
            pub fn store(self, row: &mut [f32; $count]) {
                self.0.store_array(row);
            }

            #[inline(always)]
            pub(super) fn int(self, value: i32) -> $int<S> {
                $int::splat(self.0.simd, value)
            }
        }
    };
}

lanes!(Lanes, LANES, f32x16, i32x16);
lanes!(HalfLanes, HALF, f32x8, i32x8);
