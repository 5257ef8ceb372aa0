//! What tapes read and write: streams of records, and columns of outputs.

use crate::engine::gram::Source as GramSource;
use crate::engine::lanes::Lanes;
use crate::engine::part::{Part, RowCell};
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::simd::Simd;

/// Records whose outputs stand side by side, at most: a Gram matrix adds up as many at once.
pub(super) const BATCH: usize = 16;
/// The same of a function that looks nothing up. It is over so soon that what counts is whether its outputs, some forty
/// columns, are still in the first cache when they are added up; one that looks texels up waits less for these in longer batches.
pub(super) const SHORT_BATCH: usize = 8;
/// Records ahead of which fields are asked for.
pub(super) const AHEAD: usize = 8;

/// The rows of an output. One more than are used: so the first rows of all columns are spread over the sets of a cache.
pub(super) type Column = [RowCell; BATCH + 1];

/// The streams that tapes read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StreamOf {
    Samples = 0,
    Kept,
    /// What stands in for fields that samples lack: [`NEUTRALS`], each for as many rows as a block has.
    Neutral,
    /// What pixels are compared with, a record a pixel; no tape reads it, but it is asked for meanwhile.
    Targets,
    /// What samples look up of the UV atlas.
    Levels,
}

/// The numbers that stand in for fields.
pub(super) const NEUTRALS: [f32; 2] = [0.0, 1.0];

/// Records of `stride` rows each, one for each record or group.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stream<'a> {
    pub(super) rows: &'a [Row],
    pub(super) stride: usize,
    /// Records that stand before the first one and are not there.
    pub(super) skipped: usize,
}

/// Rows of what stands in for fields that samples of at most `stride` rows lack.
pub(super) fn neutral_rows(stride: usize) -> Vec<Row> {
    let rows = |&value: &f32| std::iter::repeat_n(Row::of([value; LANES]), BATCH * stride.max(1));
    NEUTRALS.iter().flat_map(rows).collect()
}

/// The first of the rows of one of [`NEUTRALS`].
#[inline(always)]
pub(super) const fn first_neutral(rows: &[Row], which: usize) -> usize {
    which * (rows.len() / NEUTRALS.len())
}

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, cell: &RowCell) -> Lanes<S> {
    Lanes::of_row(simd, &cell.get())
}

#[inline(always)]
pub(super) fn store<S: Simd>(cell: &RowCell, value: Lanes<S>) {
    cell.set(value.to_array());
}

/// Columns as the Gram matrix reads them.
#[derive(Clone, Copy)]
pub(super) struct FileColumns<'a> {
    pub(super) columns: &'a [&'a Column],
    pub(super) groups: usize,
}

impl GramSource for FileColumns<'_> {
    #[inline(always)]
    fn columns(&self) -> usize {
        self.columns.len()
    }
    #[inline(always)]
    fn groups(&self) -> usize {
        self.groups
    }
    #[inline(always)]
    fn load<S: Simd, R: Part<S>>(&self, simd: S, [group, column, part]: [usize; 3]) -> R {
        R::get(simd, &self.columns[column][group], part)
    }
}
