//! What levels are made of, and sixteen of it as the processor computes with them at once.

use fearless_simd::prelude::*;
use fearless_simd::{Level as Instructions, f32x16, i32x16};

use super::records::Record;
use super::run::Run;
use super::wide::{Four, Wide};
use crate::engine::lanes::Lanes;
use crate::model::batch::Batch;
use crate::model::real::Real;
use crate::samples::LANES;
use crate::simd::Simd;

/// What levels are made of: f32 or f64.
pub trait Number: Real<Texel = Self, Wide = Self, Mask = bool> + From<f32> + Into<f64> + Send + Sync {
    /// Sixteen of them.
    type Sixteen<S: Simd>: Real<Texel = Self, Wide = Self::Sixteen<S>> + Wide<Self, S> + Send + Sync;
    /// Four of them.
    type Four<S: Simd>: Wide<Self, S>;

    /// How many f32 a register holds at most of the instructions that passes over levels are compiled for.
    const WIDEST: usize;

    /// The best of these that the processor has.
    fn instructions() -> Instructions {
        let best = Instructions::new();
        // A processor with AVX-512 has AVX2.
        #[cfg(target_arch = "x86_64")]
        let best = if Self::WIDEST < LANES { best.as_avx2().map_or(best, Simd::level) } else { best };
        best
    }

    /// These sixteen.
    fn load<S: Simd>(simd: S, numbers: &[Self; LANES]) -> Self::Sixteen<S>;

    /// Sixteen that are held as f32.
    fn held<S: Simd>(simd: S, numbers: &[f32; LANES]) -> Self::Sixteen<S>;

    /// The same number sixteen times.
    fn splat<S: Simd>(simd: S, number: Self) -> Self::Sixteen<S>;

    /// Each of them.
    fn array<S: Simd>(numbers: Self::Sixteen<S>) -> [Self; LANES];

    /// Each of them, which are whole.
    fn whole<S: Simd>(numbers: Self::Sixteen<S>) -> [i32; LANES];

    /// Sixteen times sixteen, rows and columns exchanged.
    fn transpose<S: Simd>(simd: S, rows: &mut [Self::Sixteen<S>; LANES]);

    /// What a pass leaves, in memory that others have left. Of the kind alone: passes are compiled here, and not once more in
    /// each crate that makes levels.
    fn leave(pass: &Run<'_, Self>, memory: Vec<Self>) -> Record<Self>;
}

impl Number for f32 {
    type Sixteen<S: Simd> = Lanes<S>;
    type Four<S: Simd> = Four<S>;
    const WIDEST: usize = LANES;

    #[inline(always)]
    fn load<S: Simd>(simd: S, numbers: &[Self; LANES]) -> Lanes<S> {
        Lanes(f32x16::load_array_ref(simd, numbers))
    }

    #[inline(always)]
    fn held<S: Simd>(simd: S, numbers: &[f32; LANES]) -> Lanes<S> {
        Self::load(simd, numbers)
    }

    #[inline(always)]
    fn splat<S: Simd>(simd: S, number: Self) -> Lanes<S> {
        Lanes::splat(simd, number)
    }

    #[inline(always)]
    fn array<S: Simd>(numbers: Lanes<S>) -> [Self; LANES] {
        numbers.to_array()
    }

    #[inline(always)]
    fn whole<S: Simd>(numbers: Lanes<S>) -> [i32; LANES] {
        let whole: i32x16<S> = numbers.0.to_int();
        whole.to_array()
    }

    /// Numbered by row and column, eight bits, they are renumbered four times by a turn of these bits: the last bit of the
    /// column goes to the front.
    #[inline(always)]
    fn transpose<S: Simd>(simd: S, rows: &mut [Lanes<S>; LANES]) {
        let mut turned = *rows;
        for _ in 0..LANES.ilog2() / 2 {
            turn(simd, rows, &mut turned);
            turn(simd, &turned, rows);
        }
    }

    fn leave(pass: &Run<'_, Self>, memory: Vec<Self>) -> Record<Self> {
        pass.record(memory)
    }
}

/// A turn of the bits by one.
#[inline(always)]
fn turn<S: Simd>(simd: S, rows: &[Lanes<S>; LANES], turned: &mut [Lanes<S>; LANES]) {
    for i in 0..LANES / 2 {
        let (even, odd) = simd.deinterleave_f32x16(rows[2 * i].0, rows[2 * i + 1].0);
        (turned[i], turned[i + LANES / 2]) = (Lanes(even), Lanes(odd));
    }
}

impl Number for f64 {
    type Sixteen<S: Simd> = Batch<Self, LANES>;
    type Four<S: Simd> = Batch<Self, 4>;
    /// What is exact and not fast is f64: AVX-512 is not compiled for it as well.
    const WIDEST: usize = 8;

    #[inline(always)]
    fn load<S: Simd>(_: S, numbers: &[Self; LANES]) -> Batch<Self, LANES> {
        Batch(*numbers)
    }

    #[inline(always)]
    fn held<S: Simd>(_: S, numbers: &[f32; LANES]) -> Batch<Self, LANES> {
        Batch(numbers.map(Self::from))
    }

    #[inline(always)]
    fn splat<S: Simd>(_: S, number: Self) -> Batch<Self, LANES> {
        Batch([number; LANES])
    }

    #[inline(always)]
    fn array<S: Simd>(numbers: Batch<Self, LANES>) -> [Self; LANES] {
        numbers.0
    }

    #[inline(always)]
    fn whole<S: Simd>(numbers: Batch<Self, LANES>) -> [i32; LANES] {
        numbers.0.map(|number| number as i32)
    }

    #[inline(always)]
    fn transpose<S: Simd>(_: S, rows: &mut [Batch<Self, LANES>; LANES]) {
        let before = *rows;
        for (i, row) in rows.iter_mut().enumerate() {
            row.0 = std::array::from_fn(|k| before[k].0[i]);
        }
    }

    fn leave(pass: &Run<'_, Self>, memory: Vec<Self>) -> Record<Self> {
        pass.record(memory)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::levels;
    use crate::with_simd;

    fn assert_transposed<S: Simd, R: Number + PartialEq + std::fmt::Debug>(simd: S) {
        let number = |i: usize, k: usize| R::from((LANES * i + k) as f32);
        let mut rows = std::array::from_fn(|i| R::load(simd, &std::array::from_fn(|k| number(i, k))));
        R::transpose(simd, &mut rows);
        for (i, row) in rows.into_iter().enumerate() {
            assert_eq!(R::array(row), std::array::from_fn(|k| number(k, i)));
        }
    }

    #[test]
    fn rows_become_columns() {
        for level in levels() {
            with_simd!(level, simd => assert_transposed::<_, f32>(simd));
            with_simd!(level, simd => assert_transposed::<_, f64>(simd));
        }
    }
}
