//! Numbers that stand side by side in a record of levels, which are read together.

use crate::samples::LANES;

/// Sixteen numbers of a record of levels.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) record: usize,
    pub(super) first: usize,
    /// Which of them are read, and the row of each.
    pub(super) rows: Vec<(usize, usize)>,
}

impl Block {
    /// The blocks that hold numbers, each given by its record, its place there, and the row that it is read into.
    pub(super) fn of(mut numbers: Vec<(usize, usize, usize)>) -> Vec<Self> {
        numbers.sort_unstable();
        let mut blocks: Vec<Self> = Vec::new();
        for (record, offset, row) in numbers {
            let there = |block: &&mut Self| {
                block.record == record && (block.first..block.first + LANES).contains(&offset)
            };
            match blocks.last_mut().filter(there) {
                Some(block) => block.rows.push((offset - block.first, row)),
                None => blocks.push(Self { record, first: offset, rows: vec![(0, row)] }),
            }
        }
        blocks
    }
}
