//! Gram matrices of columns: J^T J, J^T r and r^T r of one channel in one sweep.

use super::lanes::{HalfLanes, Lanes};
use super::part::{Part, shorter_than_rows};
use crate::samples::rows::Row;
use crate::simd::Simd;

/// Columns of numbers, a row a group of pixels.
pub(super) trait Source: Copy {
    /// How many columns there are.
    fn columns(&self) -> usize;
    /// How many rows each has.
    fn groups(&self) -> usize;
    /// A part of a group's row of a column.
    fn load<S: Simd, R: Part<S>>(&self, simd: S, at: [usize; 3]) -> R;
}

/// Add the upper triangle of the Gram matrix of the columns to `sums`, lane by lane.
///
/// Entry (i, j), i <= j, stands at [`pair`]`(i, j, count)` of `sums`. A function of its own, with
/// registers of its own: as part of a function that needs them all, it takes half as long again.
#[inline(never)]
pub(super) fn add_gram<S: Simd>(simd: S, columns: impl Source, sums: &mut [Row]) {
    simd.vectorize(
        #[inline(always)]
        || {
            // 4 x 4 products stay in the 32 registers of AVX-512, 3 x 4 halves in the 16 of AVX2.
            if shorter_than_rows::<S>() {
                (0..<HalfLanes<S> as Part<S>>::PARTS)
                    .for_each(|part| add_tiles::<S, HalfLanes<S>, 3>(simd, columns, part, sums));
            } else {
                add_tiles::<S, Lanes<S>, 4>(simd, columns, 0, sums);
            }
        },
    );
}

/// By tiles of `ROWS` x 4 columns, those on the diagonal first of their row.
#[inline(always)]
fn add_tiles<S: Simd, R: Part<S>, const ROWS: usize>(
    simd: S,
    columns: impl Source,
    part: usize,
    sums: &mut [Row],
) {
    let count = columns.columns();
    let mut i = 0;
    while i < count {
        let mut j = i;
        while j < count {
            let across = (count - j).min(4);
            let tile = Tile { columns, part, i, j };
            match (count - i >= ROWS, across, i == j) {
                (true, 4, true) => tile.add::<S, R, ROWS, 4, true>(simd, sums),
                (true, 4, false) => tile.add::<S, R, ROWS, 4, false>(simd, sums),
                (true, 3, false) => tile.add::<S, R, ROWS, 3, false>(simd, sums),
                (true, 2, false) => tile.add::<S, R, ROWS, 2, false>(simd, sums),
                (true, 1, false) => tile.add::<S, R, ROWS, 1, false>(simd, sums),
                (_, 3, _) => tile.add::<S, R, 3, 3, true>(simd, sums),
                (_, 2, _) => tile.add::<S, R, 2, 2, true>(simd, sums),
                _ => tile.add::<S, R, 1, 1, true>(simd, sums),
            }
            j += 4;
        }
        i += ROWS;
    }
}

/// Where entry (i, j), i <= j, of `count` columns stands in the packed upper triangle.
#[inline(always)]
pub(super) const fn pair(i: usize, j: usize, count: usize) -> usize {
    i * count - i * (i + 1) / 2 + j
}

/// A rectangle of the Gram matrix: rows from `i`, columns from `j`.
struct Tile<C: Source> {
    columns: C,
    part: usize,
    i: usize,
    j: usize,
}

impl<C: Source> Tile<C> {
    #[inline(always)]
    fn add<S: Simd, R: Part<S>, const ROWS: usize, const ACROSS: usize, const DIAGONAL: bool>(
        &self,
        simd: S,
        sums: &mut [Row],
    ) {
        let Self { columns, part, i, j } = *self;
        let mut products = [[R::splat(simd, 0.0); ACROSS]; ROWS];
        for group in 0..columns.groups() {
            let mut a = [R::splat(simd, 0.0); ROWS];
            for r in 0..ROWS {
                a[r] = columns.load(simd, [group, i + r, part]);
            }
            for k in 0..ACROSS {
                let b: R = columns.load(simd, [group, j + k, part]);
                let end = if DIAGONAL { ROWS.min(k + 1) } else { ROWS };
                for r in 0..end {
                    products[r][k] = a[r].mul_add(b, products[r][k]);
                }
            }
        }
        for r in 0..ROWS {
            let start = if DIAGONAL { r } else { 0 };
            for k in start..ACROSS {
                products[r][k].add_to(&mut sums[pair(i + r, j + k, columns.columns())], part);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::LANES;
    use crate::simd::{Level, levels, name};
    use crate::with_simd;

    /// Columns of three groups.
    #[derive(Clone, Copy)]
    struct Columns<'a>(&'a [[Row; 3]]);

    impl Source for Columns<'_> {
        fn columns(&self) -> usize {
            self.0.len()
        }
        fn groups(&self) -> usize {
            3
        }
        #[inline(always)]
        fn load<S: Simd, R: Part<S>>(&self, simd: S, [group, column, part]: [usize; 3]) -> R {
            R::of_part(simd, &self.0[column][group], part)
        }
    }

    #[test]
    fn every_entry_equals_the_plain_product_for_any_number_of_columns() {
        levels().into_iter().for_each(every_entry_equals_the_plain_product);
    }

    fn every_entry_equals_the_plain_product(level: Level) {
        let number = |group: usize, column: usize, lane: usize| {
            ((group * 911 + column * 148 + lane * 13) % 101) as f32 / 50.0 - 1.0
        };
        let row = |group, column| Row::of(std::array::from_fn(|lane| number(group, column, lane)));
        for count in 1..=14 {
            let columns: Vec<[Row; 3]> =
                (0..count).map(|column| [0, 1, 2].map(|group| row(group, column))).collect();
            let columns = Columns(&columns);
            let mut sums = vec![Row::ZERO; count * (count + 1) / 2];
            with_simd!(level, simd => add_gram(simd, columns, &mut sums));
            for i in 0..count {
                for j in i..count {
                    let at = |column: usize, k: usize| f64::from(number(k / LANES, column, k % LANES));
                    let want: f64 = (0..3 * LANES).map(|k| at(i, k) * at(j, k)).sum();
                    let total = |sum: &Row| -> f64 { sum.iter().map(|&x| f64::from(x)).sum() };
                    let got = total(&sums[pair(i, j, count)]);
                    // 48 products of at most 1, each rounded to 6e-8.
                    assert!((got - want).abs() < 3e-6, "{}: {count}: ({i}, {j}) {got} {want}", name(level));
                }
            }
        }
    }
}
