//! How a view is cut into parts, and what a part's buffers are written with.

use std::ops::Range;

use wgpu::Buffer;

use crate::Gpu;
use crate::records::packed;
use crate::samples::rows::Row;
use skinfit_core::engine::BLOCK;
use skinfit_core::engine::view::ObservedView;

/// Records that are packed at once: 3 to 21 MB.
const PACKED_RECORDS: usize = 1 << 14;

/// Ranges of groups, whole blocks each, whose records of `rows` rows stay within the limit. A block that is beyond
/// it on its own is left to the adapter to refuse.
pub(super) fn cut(view: &ObservedView, rows: usize, limit: u64) -> Vec<Range<usize>> {
    let groups = view.samples.groups();
    let bytes = |range: &Range<usize>| (size_of::<Row>() * rows * records(view, range).len()) as u64;
    let (mut ranges, mut start, mut end) = (Vec::new(), 0, 0);
    while end < groups {
        let next = groups.min(end + BLOCK);
        if bytes(&(start..next)) > limit && end > start {
            ranges.push(start..end);
            start = end;
        }
        end = next;
    }
    if end > start {
        ranges.push(start..end);
    }
    ranges
}

pub(super) fn records(view: &ObservedView, groups: &Range<usize>) -> Range<usize> {
    let starts = &view.samples.group_start;
    starts[groups.start] as usize..starts[groups.end] as usize
}

/// Weight and count of each block of pixels.
pub(super) fn blocks(view: &ObservedView, groups: &Range<usize>) -> Vec<(f64, u64)> {
    let block = |first: usize| view.weight_and_count(first..groups.end.min(first + BLOCK));
    groups.clone().step_by(BLOCK).map(block).collect()
}

/// Write a range of records to a buffer, as they stand on an adapter; returns how many bytes they take.
pub(super) fn write(
    gpu: &Gpu,
    buffer: &Buffer,
    (rows, stride): (&[Row], usize),
    range: &Range<usize>,
) -> u64 {
    let rows = &rows[range.start * stride..range.end * stride];
    // Some at a time: they are packed in the host's memory.
    let mut offset = 0;
    for some in rows.chunks(PACKED_RECORDS * stride.max(1)) {
        gpu.queue.write_buffer(buffer, offset, bytemuck::cast_slice(&packed(some, stride)));
        offset += size_of_val(some) as u64;
    }
    offset
}
