//! Where the numbers of a record stand on an adapter.
//!
//! The CPU keeps a record as rows of [`LANES`] numbers, one a lane: a vector's worth each. A thread of an adapter
//! reads one lane's, and four that stand together take it one load in place of four. So four rows at a time are
//! transposed to *quads*: four numbers of lane 0, then of lane 1, and so on. Up to three rows that are left over stay rows.

use rayon::prelude::*;

use crate::samples::LANES;
use crate::samples::rows::Row;

/// Numbers of a lane that stand together.
const QUAD: usize = 4;

/// Records of so many rows on an adapter, in a buffer of f32 of a name that shaders know. The buffer `<name>_quads` is
/// the same one, read four numbers at a time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoredRecords {
    pub name: &'static str,
    pub rows: usize,
}

impl StoredRecords {
    /// Rows that stand in quads.
    const fn in_quads(self) -> usize {
        self.rows / QUAD * QUAD
    }

    /// WGSL: the number of a row of `record` (a name), at `lane`.
    pub(crate) fn number(self, record: &str, row: usize) -> String {
        let (start, apart) = if row < self.in_quads() {
            (row / QUAD * QUAD * LANES + row % QUAD, format!("{QUAD}u * lane"))
        } else {
            (row * LANES, "lane".to_owned())
        };
        format!("{}[{}u * {record} + {start}u + {apart}]", self.name, self.rows * LANES)
    }

    /// WGSL: the lines that read the quads of `record`, at `lane`, that hold some of the rows.
    pub(crate) fn quads_read(self, record: &str, rows: impl IntoIterator<Item = usize>) -> String {
        let mut quads: Vec<usize> =
            rows.into_iter().filter(|&row| row < self.in_quads()).map(|row| row / QUAD).collect();
        quads.sort_unstable();
        quads.dedup();
        let (name, quads_a_record) = (self.name, self.rows * LANES / QUAD);
        let line = |quad: usize| {
            let first = quad * LANES;
            format!("    let {name}{quad} = {name}_quads[{quads_a_record}u * {record} + {first}u + lane];\n")
        };
        quads.into_iter().map(line).collect()
    }

    /// WGSL: the same, to be read after [`Self::quads_read`] with that row among others.
    pub(crate) fn read(self, record: &str, row: usize) -> String {
        if row < self.in_quads() {
            format!("{}{}[{}]", self.name, row / QUAD, row % QUAD)
        } else {
            self.number(record, row)
        }
    }
}

/// Records of `stride` rows as they stand on an adapter.
pub(crate) fn packed(rows: &[Row], stride: usize) -> Vec<f32> {
    let mut numbers: Vec<f32> = bytemuck::cast_slice(rows).to_vec();
    transpose(&mut numbers, stride, true);
    numbers
}

/// Numbers of records of `stride` rows, read from an adapter, back to rows.
pub(crate) fn unpack(numbers: &mut [f32], stride: usize) {
    transpose(numbers, stride, false);
}

/// Every four whole rows to a quad, or the other way round.
fn transpose(numbers: &mut [f32], stride: usize, to_quads: bool) {
    if stride < QUAD {
        return;
    }
    numbers.par_chunks_exact_mut(stride * LANES).for_each(|record| {
        for numbers in record.as_chunks_mut::<{ QUAD * LANES }>().0.iter_mut() {
            let old = *numbers;
            for lane in 0..LANES {
                for k in 0..QUAD {
                    let (row, quad) = (k * LANES + lane, lane * QUAD + k);
                    let (from, to) = if to_quads { (row, quad) } else { (quad, row) };
                    numbers[to] = old[from];
                }
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quads_hold_a_lanes_numbers_side_by_side_and_come_back_as_rows() {
        for stride in 1..10 {
            let number = |record: usize, row: usize, lane: usize| (record * 1000 + row * 20 + lane) as f32;
            let rows: Vec<Row> = (0..3 * stride)
                .map(|i| Row::of(std::array::from_fn(|lane| number(i / stride, i % stride, lane))))
                .collect();
            let mut numbers = packed(&rows, stride);
            for (record, numbers) in numbers.chunks_exact(stride * LANES).enumerate() {
                for row in 0..stride {
                    for lane in 0..LANES {
                        let whole = stride / 4 * 4;
                        let at =
                            if row < whole { row / 4 * 64 + lane * 4 + row % 4 } else { row * LANES + lane };
                        assert_eq!(numbers[at], number(record, row, lane), "{stride}: {row} {lane}");
                    }
                }
            }
            unpack(&mut numbers, stride);
            assert_eq!(numbers, bytemuck::cast_slice::<Row, f32>(&rows));
        }
    }
}
