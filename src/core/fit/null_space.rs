//! What the images do not determine: the directions along which they do not change.

use nalgebra::{DMatrix, SymmetricEigen};

use super::bounded::NULL_EIGENVALUE;
use super::coordinates::Coordinates;
use super::linearisation::Linearisation;
use super::outcome::Direction;

/// A column whose effect, over the size of its unknown, is below this share of the strongest one's
/// is the rounding of a zero column: the sums come from 32-bit floats.
const NULL_COLUMN: f64 = 1e-7;
/// Components of an undetermined direction below this are left out.
const LEAST_COMPONENT: f64 = 0.01;

/// H scaled to a unit diagonal over the unknowns of `takes_part` (0 elsewhere), and the scale's
/// inverse.
pub(super) fn unit_diagonal(
    model: &Linearisation,
    takes_part: impl Fn(usize) -> bool,
) -> (DMatrix<f64>, Vec<f64>) {
    let k = model.len();
    let inverse: Vec<f64> = (0..k)
        .map(|i| match model.curvature(i).sqrt() {
            d if d > 0.0 && takes_part(i) => 1.0 / d,
            _ => 0.0,
        })
        .collect();
    (DMatrix::from_fn(k, k, |i, j| model.hessian[i * k + j] * inverse[i] * inverse[j]), inverse)
}

/// The directions along which the image does not change, in variables that scale H to a unit
/// diagonal.
pub(super) struct NullSpace {
    /// Unit vectors, made as sparse as elimination makes them.
    basis: Vec<Vec<f64>>,
}

impl NullSpace {
    pub(super) fn of(coordinates: &Coordinates, model: &Linearisation) -> Self {
        let k = model.len();
        let effect: Vec<f64> =
            (0..k).map(|i| model.curvature(i).sqrt() * coordinates.size(i, model.at[i])).collect();
        let strongest = effect.iter().copied().fold(0.0, f64::max);
        let (with_effect, without): (Vec<usize>, Vec<usize>) =
            (0..k).partition(|&i| effect[i] > NULL_COLUMN * strongest);
        let unit = |i: usize| (0..k).map(|j| f64::from(i == j)).collect::<Vec<_>>();
        let mut basis: Vec<Vec<f64>> = without.iter().map(|&i| unit(i)).collect();
        if !with_effect.is_empty() {
            let (scaled, _) = unit_diagonal(model, |i| with_effect.contains(&i));
            let part = DMatrix::from_fn(with_effect.len(), with_effect.len(), |a, b| {
                scaled[(with_effect[a], with_effect[b])]
            });
            let eigen = SymmetricEigen::new(part);
            let threshold = NULL_EIGENVALUE * eigen.eigenvalues.max();
            let null = (0..with_effect.len()).filter(|&n| eigen.eigenvalues[n] <= threshold);
            let embedded = null.map(|n| {
                let mut vector = vec![0.0; k];
                for (a, &i) in with_effect.iter().enumerate() {
                    vector[i] = eigen.eigenvectors[(a, n)];
                }
                vector
            });
            basis.extend(sparse(embedded.collect()));
        }
        Self { basis }
    }

    /// An unknown that takes part in a null direction is not determined.
    pub(super) fn identifiable(&self, k: usize) -> Vec<bool> {
        (0..k).map(|i| self.basis.iter().all(|v| v[i].abs() < LEAST_COMPONENT)).collect()
    }

    /// The directions in the unknowns' own units, named.
    pub(super) fn directions(&self, coordinates: &Coordinates, model: &Linearisation) -> Vec<Direction> {
        self.basis.iter().map(|v| direction(v, coordinates, model)).collect()
    }
}

fn direction(scaled: &[f64], coordinates: &Coordinates, model: &Linearisation) -> Direction {
    let own = |i: usize| {
        let curvature = model.curvature(i).sqrt();
        // The direction of a column without any effect is its unknown alone.
        let per_unit = if curvature > 0.0 { 1.0 / curvature } else { 1.0 };
        // Who takes part is decided in scaled variables, where units do not matter.
        if scaled[i].abs() < LEAST_COMPONENT {
            0.0
        } else {
            scaled[i] * per_unit * coordinates.slope(i, model.at[i])
        }
    };
    let own: Vec<f64> = (0..scaled.len()).map(own).collect();
    let length = own.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut order: Vec<usize> =
        (0..own.len()).filter(|&i| own[i].abs() >= LEAST_COMPONENT * length).collect();
    order.sort_by(|&i, &j| own[j].abs().total_cmp(&own[i].abs()).then(i.cmp(&j)));
    let sign = order.first().map_or(1.0, |&i| own[i].signum());
    let name = |i: usize| coordinates.unknowns()[i].name();
    Direction { components: order.iter().map(|&i| (name(i), sign * own[i] / length)).collect() }
}

/// Unit vectors that span the same space, by Gauss-Jordan elimination with the largest pivots: each
/// names few unknowns, where eigenvectors of equal eigenvalues mix at will.
fn sparse(mut basis: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for row in 0..basis.len() {
        let entries = (row..basis.len()).flat_map(|r| (0..basis[r].len()).map(move |c| (r, c)));
        let Some((pivot_row, column)) =
            entries.max_by(|&(a, b), &(c, d)| basis[a][b].abs().total_cmp(&basis[c][d].abs()))
        else {
            break;
        };
        basis.swap(row, pivot_row);
        let pivot: Vec<f64> = basis[row].iter().map(|x| x / basis[row][column]).collect();
        for (other, vector) in basis.iter_mut().enumerate() {
            let factor = vector[column];
            if other != row {
                vector.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
            }
        }
        basis[row] = pivot;
    }
    for vector in &mut basis {
        let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        vector.iter_mut().for_each(|x| *x /= length);
    }
    basis
}
