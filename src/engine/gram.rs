//! Gram matrices of the scratch's columns: J^T J, J^T r and r^T r of one channel in one sweep.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

use crate::samples::rows::Row;
use crate::simd::Simd;

/// Columns within the scratch: of each group of pixels, `stride` rows, of which `count` from `first`
/// on are meant. A group's rows stand together, so that they never compete for the same cache sets.
#[derive(Clone, Copy)]
pub(super) struct Columns<'a> {
    pub rows: &'a [Row],
    pub stride: usize,
    pub first: usize,
    pub count: usize,
}

/// Add the upper triangle of the Gram matrix of the columns to `sums`, lane by lane.
///
/// Entry (i, j), i <= j, stands at [`pair`]`(i, j, count)` of `sums`. A function of its own, with
/// registers of its own: as part of a kernel that needs them all, it takes half as long again.
#[inline(never)]
pub(super) fn add_gram<S: Simd>(simd: S, columns: Columns<'_>, sums: &mut [Row]) {
    simd.vectorize(
        #[inline(always)]
        || add_tiles(simd, columns, sums),
    );
}

#[inline(always)]
fn add_tiles<S: Simd>(simd: S, columns: Columns<'_>, sums: &mut [Row]) {
    let count = columns.count;
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

/// Add the products of each column with the last one to `sums` (entry i at i): J^T r and r^T r.
#[inline(always)]
pub(super) fn add_last<S: Simd>(simd: S, columns: Columns<'_>, sums: &mut [Row]) {
    for group in columns.rows.chunks_exact(columns.stride) {
        let group = &group[columns.first..][..columns.count];
        let last = f32x16::load_array_ref(simd, &group[columns.count - 1]);
        for (column, sum) in group.iter().zip(sums.iter_mut()) {
            let product =
                f32x16::load_array_ref(simd, column).mul_add(last, f32x16::load_array_ref(simd, sum));
            product.store_array(sum);
        }
    }
}

/// Where entry (i, j), i <= j, of `count` columns stands in the packed upper triangle.
pub(super) const fn pair(i: usize, j: usize, count: usize) -> usize {
    i * count - i * (i + 1) / 2 + j
}

/// A rectangle of the Gram matrix: rows from `i`, columns from `j`.
struct Tile<'a> {
    columns: Columns<'a>,
    i: usize,
    j: usize,
}

impl Tile<'_> {
    #[inline(always)]
    fn add<S: Simd, const ROWS: usize, const ACROSS: usize, const DIAGONAL: bool>(
        &self,
        simd: S,
        sums: &mut [Row],
    ) {
        let Self { columns: Columns { rows, stride, first, count }, i, j } = *self;
        let mut products = [[f32x16::splat(simd, 0.0); ACROSS]; ROWS];
        for group in rows.chunks_exact(stride) {
            let (down, across) = (&group[first + i..][..ROWS], &group[first + j..][..ACROSS]);
            let mut b = [f32x16::splat(simd, 0.0); ACROSS];
            for k in 0..ACROSS {
                b[k] = f32x16::load_array_ref(simd, &across[k]);
            }
            for r in 0..ROWS {
                let a = f32x16::load_array_ref(simd, &down[r]);
                let start = if DIAGONAL { r } else { 0 };
                for k in start..ACROSS {
                    products[r][k] = a.mul_add(b[k], products[r][k]);
                }
            }
        }
        for r in 0..ROWS {
            let start = if DIAGONAL { r } else { 0 };
            for k in start..ACROSS {
                let sum = &mut sums[pair(i + r, j + k, count)];
                (f32x16::load_array_ref(simd, sum) + products[r][k]).store_array(sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::LANES;
    use crate::with_simd;
    use fearless_simd::Level;

    #[test]
    fn every_entry_equals_the_plain_product_for_any_number_of_columns() {
        let groups = 3;
        for count in 1..=14 {
            let (stride, first) = (count + 3, 2);
            let number = |i: usize| ((i * 37 % 101) as f32 - 50.0) / 50.0;
            let rows: Vec<Row> = (0..groups * stride)
                .map(|i| Row::of(std::array::from_fn(|lane| number(i * LANES + lane))))
                .collect();
            let columns = Columns { rows: &rows, stride, first, count };
            let mut sums = vec![Row::ZERO; count * (count + 1) / 2];
            with_simd!(Level::new(), simd => add_gram(simd, columns, &mut sums));
            let mut last = vec![Row::ZERO; count];
            with_simd!(Level::new(), simd => add_last(simd, columns, &mut last));
            for i in 0..count {
                for j in i..count {
                    let at = |column: usize, k: usize| {
                        f64::from(rows[k / LANES * stride + first + column][k % LANES])
                    };
                    let want: f64 = (0..groups * LANES).map(|k| at(i, k) * at(j, k)).sum();
                    let total = |sum: &Row| -> f64 { sum.iter().map(|&x| f64::from(x)).sum() };
                    let got = total(&sums[pair(i, j, count)]);
                    // 48 products of at most 1, each rounded to 6e-8.
                    assert!((got - want).abs() < 3e-6, "{count}: ({i}, {j}) {got} {want}");
                    if j == count - 1 {
                        assert!((total(&last[i]) - want).abs() < 3e-6);
                    }
                }
            }
        }
    }
}
