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

/// Records of `rows` rows on an adapter, in a buffer of f32 that shaders know by a name. Where they read it four numbers
/// at a time, it is bound a second time, as `<name>_quads`.
#[derive(Clone, Copy, Debug)]
pub struct StoredRecords {
    /// What shaders call it.
    pub name: &'static str,
    /// Numbers of a record, each of sixteen lanes.
    pub rows: usize,
}

impl StoredRecords {
    /// Rows that stand in quads.
    const fn in_quads(self) -> usize {
        self.rows / QUAD * QUAD
    }

    /// WGSL: the number of a row of `record` (a name), at `lane`.
    pub fn number(self, record: &str, row: usize) -> String {
        let (start, apart) = if row < self.in_quads() {
            (row / QUAD * QUAD * LANES + row % QUAD, format!("{QUAD}u * lane"))
        } else {
            (row * LANES, "lane".to_owned())
        };
        format!("{}[{}u * {record} + {start}u + {apart}]", self.name, self.rows * LANES)
    }

    /// WGSL: the lines that read the quads of `record`, at `lane`, that hold some of the rows.
    pub fn quads_read(self, record: &str, rows: impl IntoIterator<Item = usize>) -> String {
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
    pub fn read(self, record: &str, row: usize) -> String {
        if row < self.in_quads() {
            format!("{}{}[{}]", self.name, row / QUAD, row % QUAD)
        } else {
            self.number(record, row)
        }
    }
}

/// Records of `stride` rows as they stand on an adapter.
pub fn packed(rows: &[Row], stride: usize) -> Vec<f32> {
    transposed(bytemuck::cast_slice(rows), stride, |row, quad| (row, quad))
}

/// Numbers of records of `stride` rows, read from an adapter, as rows.
pub fn unpacked(numbers: &[f32], stride: usize) -> Vec<f32> {
    transposed(numbers, stride, |row, quad| (quad, row))
}

/// Every four whole rows to a quad, or the other way round: for a place among the rows and the one in the quad, from
/// which to which a number goes.
fn transposed(
    numbers: &[f32],
    stride: usize,
    from_to: impl Fn(usize, usize) -> (usize, usize) + Sync,
) -> Vec<f32> {
    let record = (stride * LANES).max(1);
    let mut moved = vec![0.0; numbers.len()];
    moved.par_chunks_mut(record).zip(numbers.par_chunks(record)).for_each(|(moved, numbers)| {
        let (quads, rest) = moved.as_chunks_mut::<{ QUAD * LANES }>();
        let (of_quads, of_rest) = numbers.as_chunks::<{ QUAD * LANES }>();
        rest.copy_from_slice(of_rest);
        for (moved, numbers) in quads.iter_mut().zip(of_quads) {
            for lane in 0..LANES {
                for k in 0..QUAD {
                    let (from, to) = from_to(k * LANES + lane, lane * QUAD + k);
                    moved[to] = numbers[from];
                }
            }
        }
    });
    moved
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
            let numbers = packed(&rows, stride);
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
            assert_eq!(unpacked(&numbers, stride), bytemuck::cast_slice::<Row, f32>(&rows));
        }
    }

    #[test]
    fn shaders_find_what_was_packed() {
        let stored = StoredRecords { name: "samples", rows: 6 };
        // Rows 4 and 5 are left over.
        assert_eq!(stored.number("group", 2), "samples[96u * group + 2u + 4u * lane]");
        assert_eq!(stored.number("group", 5), "samples[96u * group + 80u + lane]");
        assert_eq!(stored.read("group", 2), "samples0[2]");
        assert_eq!(stored.read("group", 5), stored.number("group", 5));
        let lines = stored.quads_read("group", [5, 1, 3]);
        assert_eq!(lines, "    let samples0 = samples_quads[24u * group + 0u + lane];\n");
        let two = StoredRecords { name: "samples", rows: 8 };
        assert_eq!(two.number("r", 7), "samples[128u * r + 67u + 4u * lane]");
        assert_eq!(two.quads_read("r", [7]), "    let samples1 = samples_quads[32u * r + 16u + lane];\n");
        let none = StoredRecords { name: "targets", rows: 3 };
        assert_eq!((none.quads_read("g", 0..3), none.read("g", 1)), (String::new(), none.number("g", 1)));
    }
}
