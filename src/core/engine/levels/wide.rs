//! Several numbers of a texel at once: sixteen, or as many as a level alone has.

use std::ops::{Add, Mul, Sub};

use fearless_simd::f32x4;
use fearless_simd::prelude::*;

use crate::engine::lanes::Lanes;
use crate::model::batch::Batch;
use crate::model::real::Real;
use crate::samples::LANES;
use crate::simd::Simd;

/// Several numbers as sums are made of them.
pub trait Wide<R, S: Simd>: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// How many.
    const COUNT: usize;

    /// These numbers from a place on.
    fn load(simd: S, numbers: &[R], at: usize) -> Self;

    /// The number in each lane.
    fn splat(simd: S, number: R) -> Self;

    /// `self * a + b`, in one rounding where the hardware has it.
    fn times_plus(self, a: Self, b: Self) -> Self;

    /// Into the first of these numbers; where there are fewer, into those.
    fn store(self, numbers: &mut [R]);

    /// The first three.
    fn three(self) -> [R; 3];
}

/// Four numbers in one register.
#[derive(Clone, Copy)]
pub struct Four<S: Simd>(f32x4<S>);

macro_rules! operator {
    ($trait:ident $method:ident) => {
        impl<S: Simd> $trait for Four<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
    };
}
operator!(Add add);
operator!(Sub sub);
operator!(Mul mul);

impl<S: Simd> Wide<f32, S> for Four<S> {
    const COUNT: usize = 4;

    #[inline(always)]
    fn load(simd: S, numbers: &[f32], at: usize) -> Self {
        Self(f32x4::load_array_ref(simd, several(numbers, at)))
    }

    #[inline(always)]
    fn splat(simd: S, number: f32) -> Self {
        Self(f32x4::splat(simd, number))
    }

    #[inline(always)]
    fn times_plus(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_add(a.0, b.0))
    }

    #[inline(always)]
    fn store(self, numbers: &mut [f32]) {
        put(&self.0.to_array(), numbers);
    }

    #[inline(always)]
    fn three(self) -> [f32; 3] {
        let [x, y, z, _] = self.0.to_array();
        [x, y, z]
    }
}

impl<S: Simd> Wide<f32, S> for Lanes<S> {
    const COUNT: usize = LANES;

    #[inline(always)]
    fn load(simd: S, numbers: &[f32], at: usize) -> Self {
        Self::of_row(simd, several(numbers, at))
    }

    #[inline(always)]
    fn splat(simd: S, number: f32) -> Self {
        Self::splat(simd, number)
    }

    #[inline(always)]
    fn times_plus(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }

    #[inline(always)]
    fn store(self, numbers: &mut [f32]) {
        match numbers.first_chunk_mut() {
            Some(numbers) => Self::store(self, numbers),
            None => put(&self.to_array(), numbers),
        }
    }

    #[inline(always)]
    fn three(self) -> [f32; 3] {
        let [x, y, z, ..] = self.to_array();
        [x, y, z]
    }
}

impl<S: Simd, const N: usize> Wide<f64, S> for Batch<f64, N> {
    const COUNT: usize = N;

    #[inline(always)]
    fn load(_: S, numbers: &[f64], at: usize) -> Self {
        Self(*several(numbers, at))
    }

    #[inline(always)]
    fn splat(_: S, number: f64) -> Self {
        Self([number; N])
    }

    #[inline(always)]
    fn times_plus(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }

    #[inline(always)]
    fn store(self, numbers: &mut [f64]) {
        put(&self.0, numbers);
    }

    #[inline(always)]
    fn three(self) -> [f64; 3] {
        std::array::from_fn(|c| self.0[c])
    }
}

/// `N` numbers from `at` on. Behind the last texel's stand those that mean nothing.
#[inline(always)]
fn several<R, const N: usize>(numbers: &[R], at: usize) -> &[R; N] {
    match numbers[at..at + N].first_chunk() {
        Some(numbers) => numbers,
        None => unreachable!("{N} of {N}"),
    }
}

/// The first of several numbers, as many as there is room for: a multiple of four.
#[inline(always)]
fn put<R: Copy, const N: usize>(numbers: &[R; N], room: &mut [R]) {
    if let Some(room) = room.first_chunk_mut() {
        *room = *numbers;
        return;
    }
    let (numbers, _) = numbers.as_chunks::<4>();
    let (room, _) = room.as_chunks_mut::<4>();
    for (room, numbers) in room.iter_mut().zip(numbers) {
        *room = *numbers;
    }
}
