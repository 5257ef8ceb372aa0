//! Gram matrices of columns: J^T J, J^T r and r^T r of one channel in one sweep.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

use crate::samples::rows::Row;
use crate::simd::Simd;

/// Columns of numbers, a row a group of pixels.
pub(super) trait Source: Copy {
    /// How many columns there are.
    fn columns(&self) -> usize;
    /// How many rows each has.
    fn groups(&self) -> usize;
    /// A group's row of a column.
    fn load<S: Simd>(&self, simd: S, group: usize, column: usize) -> f32x16<S>;
}

/// Add the upper triangle of the Gram matrix of the columns to `sums`, lane by lane.
///
/// Entry (i, j), i <= j, stands at [`pair`]`(i, j, count)` of `sums`. A function of its own, with
/// registers of its own: as part of a function that needs them all, it takes half as long again.
#[inline(never)]
pub(super) fn add_gram<S: Simd>(simd: S, columns: impl Source, sums: &mut [Row]) {
    simd.vectorize(
        #[inline(always)]
        || add_tiles(simd, columns, sums),
    );
}

#[inline(always)]
fn add_tiles<S: Simd>(simd: S, columns: impl Source, sums: &mut [Row]) {
    let count = columns.columns();
    // Tiles of 4 x 4 columns: 16 products for 8 loads.
    let mut i = 0;
    while i < count {
        let rows = (count - i).min(4);
        let mut j = i;
        while j < count {
            let across = (count - j).min(4);
            let tile = Tile { columns, i, j };
            match (rows, across) {
                (4, 4) if i == j => tile.add::<S, 4, 4, true>(simd, sums),
                (4, 4) => tile.add::<S, 4, 4, false>(simd, sums),
                (4, 3) => tile.add::<S, 4, 3, false>(simd, sums),
                (4, 2) => tile.add::<S, 4, 2, false>(simd, sums),
                (4, _) => tile.add::<S, 4, 1, false>(simd, sums),
                (3, _) => tile.add::<S, 3, 3, true>(simd, sums),
                (2, _) => tile.add::<S, 2, 2, true>(simd, sums),
                _ => tile.add::<S, 1, 1, true>(simd, sums),
            }
            j += 4;
        }
        i += 4;
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
    i: usize,
    j: usize,
}

impl<C: Source> Tile<C> {
    #[inline(always)]
    fn add<S: Simd, const ROWS: usize, const ACROSS: usize, const DIAGONAL: bool>(
        &self,
        simd: S,
        sums: &mut [Row],
    ) {
        let Self { columns, i, j } = *self;
        let mut products = [[f32x16::splat(simd, 0.0); ACROSS]; ROWS];
        for group in 0..columns.groups() {
            let mut b = [f32x16::splat(simd, 0.0); ACROSS];
            for k in 0..ACROSS {
                b[k] = columns.load(simd, group, j + k);
            }
            for r in 0..ROWS {
                let a = columns.load(simd, group, i + r);
                let start = if DIAGONAL { r } else { 0 };
                for k in start..ACROSS {
                    products[r][k] = a.mul_add(b[k], products[r][k]);
                }
            }
        }
        for r in 0..ROWS {
            let start = if DIAGONAL { r } else { 0 };
            for k in start..ACROSS {
                let sum = &mut sums[pair(i + r, j + k, columns.columns())];
                (f32x16::load_array_ref(simd, sum) + products[r][k]).store_array(sum);
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
        fn load<S: Simd>(&self, simd: S, group: usize, column: usize) -> f32x16<S> {
            f32x16::load_array_ref(simd, &self.0[column][group])
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
