//! Texels beyond the charts of an atlas that are filled from their neighbours (MODEL 6.5, `lookup = "dilated"`).
//!
//! A lookup by one fetch weighs texels whatever they hold. So that no darkness comes in from beyond a chart, empty texels
//! take the mean of the filled ones among their eight neighbours, two rings deep.

use std::collections::HashMap;

/// How many rings of empty texels are filled.
const RINGS: usize = 2;

/// Which texels are filled beyond those that are covered, and from which.
///
/// Filled texels are numbered on from the covered ones, ring by ring and row by row; those that show just another have its
/// number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dilation {
    /// The number of each filled texel, by its place in the atlas.
    numbers: HashMap<u32, u32>,
    /// Where each filled texel's neighbours end in `neighbours`.
    ends: Vec<usize>,
    /// Numbers of the texels that filled ones are the means of.
    neighbours: Vec<u32>,
}

impl Dilation {
    /// Of an atlas `size` texels a side; `covered` gives the number of a texel that holds something, of which there are
    /// `count`.
    pub(super) fn new(size: u32, count: usize, covered: impl Fn(u32) -> Option<u32>) -> Self {
        let mut dilation = Self::default();
        // What the ring before has filled; first all that is covered.
        let mut last: Vec<u32> = (0..size * size).filter(|&texel| covered(texel).is_some()).collect();
        for _ in 0..RINGS {
            let filled = |texel: u32| covered(texel).or_else(|| dilation.numbers.get(&texel).copied());
            let mut ring: Vec<u32> =
                last.iter().flat_map(|&texel| around(size, texel)).filter(|&t| filled(t).is_none()).collect();
            ring.sort_unstable();
            ring.dedup();
            let (mut ends, mut neighbours) = (Vec::new(), Vec::new());
            for &texel in &ring {
                neighbours.extend(around(size, texel).filter_map(filled));
                ends.push(dilation.neighbours.len() + neighbours.len());
            }
            let first = (count + dilation.ends.len()) as u32;
            dilation.numbers.extend((first..).zip(&ring).map(|(number, &texel)| (texel, number)));
            dilation.ends.extend(ends);
            dilation.neighbours.extend(neighbours);
            last = ring;
        }
        dilation
    }

    /// Empty texels that each show one that is covered, by their places in the atlas and the numbers of those.
    pub(super) fn of_copies(copies: impl Iterator<Item = (u32, u32)>) -> Self {
        Self { numbers: copies.collect(), ..Self::default() }
    }

    /// Where filled texels each show another: their places in the atlas and the numbers of those, in the order of places;
    /// `None` where they are means.
    #[must_use]
    pub fn copies(&self) -> Option<Vec<(u32, u32)>> {
        self.ends.is_empty().then(|| {
            let mut copies: Vec<_> = self.numbers.iter().map(|(&texel, &number)| (texel, number)).collect();
            copies.sort_unstable();
            copies
        })
    }

    /// The number of a filled texel, by its place in the atlas, row by row.
    #[must_use]
    #[inline]
    pub fn number(&self, texel: u32) -> Option<usize> {
        self.numbers.get(&texel).map(|&number| number as usize)
    }

    /// Of each filled texel, in the order of their numbers, those that it is the mean of.
    pub fn filled(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        let start = |at: usize| at.checked_sub(1).map_or(0, |before| self.ends[before]);
        (0..self.ends.len()).map(move |at| &self.neighbours[start(at)..self.ends[at]])
    }
}

/// The neighbours of a texel, row by row, as far as the atlas goes.
fn around(size: u32, texel: u32) -> impl Iterator<Item = u32> {
    let [column, row] = [texel % size, texel / size].map(i64::from);
    let steps = (-1..=1).flat_map(|down| (-1..=1).map(move |along| (along, down)));
    let inside = move |at: i64| (0..i64::from(size)).contains(&at);
    let places = steps.filter(|step| *step != (0, 0)).map(move |(along, down)| (column + along, row + down));
    places.filter(move |&(x, y)| inside(x) && inside(y)).map(move |(x, y)| y as u32 * size + x as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rings_are_filled_each_from_the_one_before() {
        // Of six texels a side the two at the top left are covered.
        let dilation = Dilation::new(6, 2, |texel| (texel < 2).then_some(texel));
        let mut level = vec![[1.0, 2.0, 0.0], [3.0, 2.0, 0.0]];
        for near in dilation.filled() {
            let mean =
                |c: usize| near.iter().map(|&at| level[at as usize][c]).sum::<f64>() / near.len() as f64;
            let mean = [0, 1, 2].map(mean);
            level.push(mean);
        }
        let at = |column: u32, row: u32| dilation.number(6 * row + column).map(|number| level[number]);
        assert_eq!((at(0, 0), at(1, 0)), (None, None));
        // Beside both, beside one, and of the first ring alone: of (1, 1) and (2, 1), and of (2, 0) and (2, 1).
        assert_eq!(
            [at(0, 1), at(1, 1), at(2, 0)],
            [Some([2.0, 2.0, 0.0]), Some([2.0, 2.0, 0.0]), Some([3.0, 2.0, 0.0])]
        );
        assert_eq!([at(3, 0), at(3, 2)], [Some([3.0, 2.0, 0.0]); 2]);
        assert_eq!([at(0, 2), at(4, 0), at(3, 3)], [Some([2.0, 2.0, 0.0]), None, None]);
        assert_eq!(level.len(), 2 + 4 + 6);
    }
}
