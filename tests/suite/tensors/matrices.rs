//! Fixed linear maps and their transposes.

use burn::tensor::Tensor;
use skinfit::maps::problem::largest;
use skinfit::model::cube::Cube;
use skinfit::tensor::Sparse;
use skinfit::tensor::footprint::cube_border;
use skinfit::tensor::sparse::Entries;

use super::bench::{Random, assert_near, matrix, numbers, shared};

fn random_entries(rows: usize, columns: usize, random: &mut Random) -> Entries {
    let mut entries = Entries::new(columns);
    for row in 0..rows {
        let count = row % 5;
        let at = |random: &mut Random| (random.next() * columns as f64) as u32;
        let list: Vec<_> = (0..count).map(|_| (at(random), random.next() as f32 - 0.3)).collect();
        entries.push_row(list);
    }
    entries
}

fn multiply(entries: &Entries, x: &[f64], channels: usize) -> Vec<f64> {
    let mut product = vec![0.0; entries.rows() * channels];
    for row in 0..entries.rows() {
        for k in entries.starts[row] as usize..entries.starts[row + 1] as usize {
            for c in 0..channels {
                product[row * channels + c] +=
                    f64::from(entries.weight[k]) * x[entries.column[k] as usize * channels + c];
            }
        }
    }
    product
}

#[test]
fn products_and_their_gradients_are_those_of_the_matrix_and_its_transpose() {
    let Some(shared) = shared() else { return };
    let mut random = Random::new(3);
    for (rows, columns, channels) in [(300, 70, 3), (17, 900, 1), (64, 64, 4)] {
        let entries = random_entries(rows, columns, &mut random);
        let sparse = Sparse::new(shared, &entries).unwrap();
        let (x, g) = (random.list(columns * channels, -1.0, 1.0), random.list(rows * channels, -1.0, 1.0));
        let tracked = matrix(&x, channels, &shared.device().clone().autodiff()).require_grad();
        let product = sparse.apply(tracked.clone()).unwrap();
        // A few roundings of f32 for the few entries of a row.
        assert_near(&numbers(product.clone()), &multiply(&entries, &x, channels), 1e-6, "product");
        let adjoint: Tensor<2> = matrix(&g, channels, &shared.device().clone().autodiff());
        let gradients = (product * adjoint).sum().backward();
        let got = numbers(tracked.grad(&gradients).unwrap());
        // Columns have up to some forty entries.
        assert_near(&got, &multiply(&entries.transposed(), &g, channels), 4e-6, "gradient");
    }
}

#[test]
fn the_same_numbers_give_the_same_bits() {
    let Some(shared) = shared() else { return };
    let mut random = Random::new(5);
    let entries = random_entries(5000, 40, &mut random);
    let sparse = Sparse::new(shared, &entries).unwrap();
    let g = random.list(3 * 5000, -1.0, 1.0);
    let once = || {
        let device = shared.device().clone().autodiff();
        let x = Tensor::<2>::ones([40, 3], &device).require_grad();
        let gradients = (sparse.apply(x.clone()).unwrap() * matrix(&g, 3, &device)).sum().backward();
        numbers(x.grad(&gradients).unwrap())
    };
    let first = once();
    assert!((0..3).all(|_| once() == first));
}

#[test]
fn a_cubes_border_is_the_one_that_the_cube_itself_makes() {
    for size in [1, 2, 5] {
        let mut random = Random::new(size as u64);
        let texels: Vec<[f64; 4]> =
            (0..6 * size * size).map(|_| std::array::from_fn(|_| random.next())).collect();
        let cube = Cube::from_fn(size, |face, column, row| texels[(face * size + row) * size + column]);
        let padded = multiply(&cube_border(size), texels.as_flattened(), 4);
        for (got, want) in padded.iter().zip(cube.padded().as_flattened()) {
            // A third is rounded to f32.
            assert!((got - want).abs() < 1e-7, "{got} {want}");
        }
    }
}

#[test]
fn the_largest_of_many_numbers_is_found_wherever_it_stands() {
    let Some(shared) = shared() else { return };
    // More than one dispatch of burn's reductions takes.
    let rows = 400_000;
    for at in [0, rows / 2, rows - 1] {
        let mut list = vec![0.25; 3 * rows];
        list[3 * at + 1] = 0.5;
        assert_eq!(largest(matrix(&list, 3, shared.device())).unwrap(), 0.5, "{at}");
    }
}
