//! A block of records as a function sees it that is compiled ahead.

use prefetch_index::prefetch_index;

use super::streams::{AHEAD, Column, Stream, StreamOf, first_neutral};
use crate::engine::part::Part;
use crate::model::cube::Cube;
use crate::model::real::Real;
use crate::samples::rows::{Row, prefetch_rows};
use crate::simd::Simd;

/// `count` records from `first` on, at most [`BATCH`](super::streams::BATCH), and where their outputs go.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    /// For each field, the stream that holds it and its row there.
    pub(super) loads: &'a [(StreamOf, usize)],
    /// The numbers that all samples share.
    pub(super) uniforms: &'a [f32],
    pub(super) streams: &'a [Stream<'a>],
    pub(super) first: usize,
    pub(super) count: usize,
    pub(super) cubes: &'a [&'a Cube<f32>],
    pub(super) columns: &'a [Column],
}

impl<'a> Block<'a> {
    #[inline(always)]
    fn stream(&self, stream: StreamOf) -> Stream<'a> {
        self.streams[stream as usize]
    }

    /// The numbers that all samples share.
    #[inline(always)]
    pub(super) fn uniforms<const N: usize>(&self) -> &'a [f32; N] {
        self.uniforms.first_chunk().unwrap_or(&[0.0; N])
    }

    /// The row of record `i` of the block among a field's. Asks for what its pixel is compared with.
    #[inline(always)]
    pub(super) fn begin(&self, i: usize) -> usize {
        let Stream { rows, stride, .. } = self.stream(StreamOf::Targets);
        prefetch_rows(rows, (self.first + i) * stride, stride);
        i * self.stride()
    }

    /// Rows between one record's numbers and the next one's.
    #[inline(always)]
    fn stride(&self) -> usize {
        self.stream(StreamOf::Samples).stride
    }

    /// Each field's rows, from the first record's on. Fields that samples lack have rows of what stands in.
    #[inline(always)]
    pub(super) fn fields<const N: usize>(&self) -> [&'a [Row]; N] {
        let stride = self.stride();
        let mut fields: [&[Row]; N] = [&[]; N];
        // In a loop: what a function calls that makes arrays is not made part of this one.
        for k in 0..N.min(self.loads.len()) {
            let (stream, place) = self.loads[k];
            fields[k] = match stream {
                StreamOf::Samples => &self.stream(stream).rows[self.first * stride + place..],
                StreamOf::Neutral => {
                    let rows = self.stream(stream).rows;
                    &rows[first_neutral(rows, place)..]
                }
                // They are read by [`Self::kept`], and by no tape; no effect that is compiled ahead has texels.
                StreamOf::Kept | StreamOf::Targets | StreamOf::Levels => &[],
            };
        }
        fields
    }

    /// The kept numbers of record `i` of the block. Asks for a later record's as well.
    #[inline(always)]
    pub(super) fn kept<const N: usize>(&self, i: usize) -> &'a [Row; N] {
        let Stream { rows, stride, .. } = self.stream(StreamOf::Kept);
        prefetch_rows(rows, (self.first + i + AHEAD) * stride, N);
        rows[(self.first + i) * stride..].first_chunk().unwrap_or(&[Row::ZERO; N])
    }

    /// A part of a field's number, of the record whose row that is. Asks for a later record's as well.
    #[inline(always)]
    pub(super) fn number<S: Simd, R: Part<S>>(&self, simd: S, field: &[Row], at: usize, part: usize) -> R {
        prefetch_index(field, at + AHEAD * self.stride());
        R::of_part(simd, &field[at], part)
    }

    /// The outputs' columns, where there are as many.
    #[inline(always)]
    pub(super) fn columns<const N: usize>(&self) -> Option<&'a [Column; N]> {
        self.columns.first_chunk()
    }
}

/// How a lookup moves that is `ds` and `dt` texels further.
#[inline(always)]
pub(super) fn along<R: Real>([ds, dt]: [R; 2], across: [R; 4], down: [R; 4]) -> [R; 4] {
    let ([a, b, c, d], [e, f, g, h]) = (across, down);
    [ds.mul_add(a, dt * e), ds.mul_add(b, dt * f), ds.mul_add(c, dt * g), ds.mul_add(d, dt * h)]
}
