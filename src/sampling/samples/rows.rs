//! Numbers of sixteen pixels side by side, and several such rows a record.
//!
//! Twenty planes read in step would be twenty streams, which no prefetcher follows and which compete
//! for the same cache sets, as planes of equal length do; a record is read from one stream.

use std::ops::{Deref, DerefMut, Range};

use bytemuck::{Pod, Zeroable};
use prefetch_index::prefetch_index;
use rayon::prelude::*;

use super::LANES;

/// One vector's worth of numbers, on a cache line of its own.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Row([f32; LANES]);

impl Row {
    /// All zero.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// A row of these numbers.
    #[must_use]
    pub const fn of(numbers: [f32; LANES]) -> Self {
        Self(numbers)
    }
}

impl Deref for Row {
    type Target = [f32; LANES];
    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Row {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// `count` rows, all zero. All cores: fresh memory is handed out page by page.
#[must_use]
pub fn zeros(count: usize) -> Vec<Row> {
    (0..count).into_par_iter().with_min_len(1 << 12).map(|_| Row::ZERO).collect()
}

/// Records of `stride` rows each, one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    stride: usize,
    rows: Vec<Row>,
}

impl Rows {
    /// `count` records of `stride` rows, all zero.
    #[must_use]
    pub fn new(stride: usize, count: usize) -> Self {
        Self { stride, rows: zeros(stride * count) }
    }

    /// Rows a record.
    #[must_use]
    #[inline]
    pub const fn stride(&self) -> usize {
        self.stride
    }

    /// Every row, record by record.
    #[must_use]
    #[inline]
    pub fn all(&self) -> &[Row] {
        &self.rows
    }

    pub(super) fn all_mut(&mut self) -> &mut [Row] {
        &mut self.rows
    }

    /// Set every number, as far as there are some: row after row of each record.
    pub fn fill(&mut self, numbers: &[f32]) {
        self.rows.iter_mut().zip(numbers.as_chunks::<LANES>().0).for_each(|(row, numbers)| row.0 = *numbers);
    }

    /// A range of records.
    #[must_use]
    pub(super) fn part(&self, records: Range<usize>) -> Self {
        let rows = records.start * self.stride..records.end * self.stride;
        Self { stride: self.stride, rows: self.rows[rows].to_vec() }
    }

    /// A record's rows.
    #[inline(always)]
    #[must_use]
    pub fn record(&self, index: usize) -> &[Row] {
        &self.rows[index * self.stride..][..self.stride]
    }

    /// A record's rows.
    pub fn record_mut(&mut self, index: usize) -> &mut [Row] {
        &mut self.rows[index * self.stride..][..self.stride]
    }

    /// The number at `place` of a record, for the pixel at `slot` (`record * LANES + lane`).
    #[must_use]
    #[inline]
    pub fn number(&self, place: usize, slot: usize) -> f32 {
        self.record(slot / LANES)[place][slot % LANES]
    }

    /// The numbers at `place` of each record, slot after slot.
    pub fn plane_mut(&mut self, place: usize) -> impl Iterator<Item = &mut f32> {
        self.rows.chunks_exact_mut(self.stride).flat_map(move |record| record[place].iter_mut())
    }
}

/// Ask for `count` rows from `first` on; they may lie beyond the end.
#[inline(always)]
pub fn prefetch_rows(rows: &[Row], first: usize, count: usize) {
    for row in first..first + count {
        prefetch_index(rows, row);
    }
}
