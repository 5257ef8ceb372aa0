//! Parts of rows: what is computed of a row at once, so that a number takes one register or two.

use std::cell::Cell;

use fearless_simd::SimdBase;

use crate::engine::lanes::{HALF, HalfLanes, Lanes};
use crate::model::real::Real;
use crate::samples::LANES;
use crate::simd::Simd;

/// A row that is written through shared references, whole or by its halves.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub(super) struct RowCell([Cell<[f32; HALF]>; 2]);

impl RowCell {
    #[inline(always)]
    pub(super) fn get(&self) -> [f32; LANES] {
        let mut row = [0.0; LANES];
        let (halves, _) = row.as_chunks_mut();
        halves[0] = self.0[0].get();
        halves[1] = self.0[1].get();
        row
    }

    #[inline(always)]
    pub(super) fn set(&self, row: [f32; LANES]) {
        let (halves, _) = row.as_chunks();
        self.0[0].set(halves[0]);
        self.0[1].set(halves[1]);
    }
}

/// Whether registers are shorter than rows.
#[inline(always)]
pub(super) const fn shorter_than_rows<S: Simd>() -> bool {
    <S::f32s as SimdBase<S>>::LEN < LANES
}

/// A part of a row's numbers: all of them, or half of them where registers are shorter.
pub(super) trait Part<S: Simd>: Real<Texel = f32> {
    /// How many parts a row has.
    const PARTS: usize;

    /// `value` in every lane.
    fn splat(simd: S, value: f32) -> Self;

    /// Part `part` of a row's values.
    fn of_part(simd: S, row: &[f32; LANES], part: usize) -> Self;

    /// The same of a row that is written meanwhile.
    fn get(simd: S, row: &RowCell, part: usize) -> Self;

    /// Into part `part` of a row.
    fn put(self, row: &RowCell, part: usize);

    /// Onto part `part` of a row's values.
    fn add_to(self, row: &mut [f32; LANES], part: usize);
}

impl<S: Simd> Part<S> for Lanes<S> {
    const PARTS: usize = 1;

    #[inline(always)]
    fn splat(simd: S, value: f32) -> Self {
        Self::splat(simd, value)
    }

    #[inline(always)]
    fn of_part(simd: S, row: &[f32; LANES], _: usize) -> Self {
        Self::of_row(simd, row)
    }

    #[inline(always)]
    fn get(simd: S, row: &RowCell, _: usize) -> Self {
        Self::of_row(simd, &row.get())
    }

    #[inline(always)]
    fn put(self, row: &RowCell, _: usize) {
        row.set(self.to_array());
    }

    #[inline(always)]
    fn add_to(self, row: &mut [f32; LANES], _: usize) {
        (Self::of_row(self.0.simd, row) + self).store(row);
    }
}

impl<S: Simd> Part<S> for HalfLanes<S> {
    const PARTS: usize = 2;

    #[inline(always)]
    fn splat(simd: S, value: f32) -> Self {
        Self::splat(simd, value)
    }

    #[inline(always)]
    fn of_part(simd: S, row: &[f32; LANES], part: usize) -> Self {
        Self::of_row(simd, &row.as_chunks().0[part])
    }

    #[inline(always)]
    fn get(simd: S, row: &RowCell, part: usize) -> Self {
        Self::of_row(simd, &row.0[part].get())
    }

    #[inline(always)]
    fn put(self, row: &RowCell, part: usize) {
        row.0[part].set(self.to_array());
    }

    #[inline(always)]
    fn add_to(self, row: &mut [f32; LANES], part: usize) {
        let half = &mut row.as_chunks_mut().0[part];
        (Self::of_row(self.0.simd, half) + self).store(half);
    }
}
