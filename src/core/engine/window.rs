//! A group's window in the scratch: the columns and the residual of each channel, a row each.
//!
//! A column's row follows from its parameter and channel alone. So the kernel stores to places that are
//! known when it is compiled: with all lookups kept, a pass takes a third less time than with places that are
//! looked up. Rows of parameters that are held are never read.

use crate::model::params::Param;
use crate::samples::rows::Row;

/// Rows of a channel: a column for each parameter of the table, the view's gain, the residual.
const CHANNEL: usize = 16;
const GAIN: usize = Param::COUNT;
const RESIDUAL: usize = CHANNEL - 1;
const _: () = assert!(GAIN < RESIDUAL);

/// Three colours and alpha.
const ROWS: usize = 4 * CHANNEL;

/// The rows of one group of pixels, of each a number a pixel.
///
/// One row more than there are columns: at a distance of 4,096 bytes the same row of every group would compete
/// for the same few lines of the cache.
pub(super) type Window = [Row; ROWS + 1];

/// No numbers yet.
pub(super) const EMPTY: Window = [Row::ZERO; ROWS + 1];

/// The row of a parameter's column.
#[inline(always)]
pub(super) const fn column(channel: usize, param: Param) -> usize {
    channel * CHANNEL + param.index()
}

/// The row of the gain's column.
#[inline(always)]
pub(super) const fn gain(channel: usize) -> usize {
    channel * CHANNEL + GAIN
}

/// The row of the residual (of the value, until a target is subtracted).
#[inline(always)]
pub(super) const fn residual(channel: usize) -> usize {
    channel * CHANNEL + RESIDUAL
}

/// The row at `place`, which is always within the window; written so that the compiler sees it.
#[inline(always)]
pub(super) fn row(window: &Window, place: usize) -> &Row {
    &window[place % ROWS]
}

/// The row at `place`, to be changed.
#[inline(always)]
pub(super) fn row_mut(window: &mut Window, place: usize) -> &mut Row {
    &mut window[place % ROWS]
}
