//! What the normal equations say of an answer: standard errors, correlations, and what the images
//! cannot determine.
//!
//! With weights w, residuals r and n of them above weight 0, and K the rank of J over the unknowns
//! that no bound holds:
//!
//! - `s^2 = sum(w r^2) / (n - K)`: the variance of a residual of unit weight. Scaling all weights
//!   changes neither this over `J'WJ` nor anything below.
//! - `Cov = s^2 (J'WJ)^-1`, by the eigenvalues of J'WJ scaled to a unit diagonal, leaving out those
//!   below [`NULL_EIGENVALUE`] times the largest: along their eigenvectors the images say nothing.
//!
//! - `s^2` is no less than the sum of squares that the engine's roundings alone may leave
//!   ([`Objective::rounding`](crate::engine::Objective::rounding)), not divided by n: a parameter, a
//!   texel or a cube rounded to 32 bits is off by the same in many pixels, and such errors do not
//!   average out. A disturbance of the image of weighted sum of squares E moves an unknown by
//!   at most `sqrt(E (J'WJ)^-1_ii)` (Cauchy and Schwarz). With a noise of a thousandth or more it
//!   is far below `s^2`; of a fit to noise-free images it is what the error consists of.
//!
//! It holds for residuals that are independent, of variance in inverse proportion to w, and about
//! linear in the unknowns over a standard error. Where a model misses what an image shows, neighbouring
//! residuals are alike, and the true errors are greater. A robust loss enters by its reweighted
//! quadratic.

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

/// What is known of an answer, in the order of the unknowns.
#[derive(Clone, Debug)]
pub struct Statistics {
    /// One standard error, in the unknown's own unit; `None` when unidentifiable, at a bound, or
    /// without residuals to spare.
    pub std_errors: Vec<Option<f64>>,
    /// Whether the images determine the unknown.
    pub identifiable: Vec<bool>,
    /// K x K, row-major; 0 beside unknowns without a standard error.
    pub correlations: Vec<f64>,
    /// What they do not.
    pub undetermined: Vec<Direction>,
}

impl Statistics {
    /// What `model` says of an answer of which the unknowns of `at_bound` are held by their bounds;
    /// `rounding` is what roundings may leave of its residual.
    #[must_use]
    pub fn new(coordinates: &Coordinates, model: &Linearisation, at_bound: &[bool], rounding: f64) -> Self {
        let k = model.len();
        let null = NullSpace::of(coordinates, model);
        let identifiable = null.identifiable(k);
        let known: Vec<usize> = (0..k).filter(|&i| identifiable[i] && !at_bound[i]).collect();
        let covariance = covariance(model, at_bound, rounding);
        let deviation = |i: usize| covariance.as_ref().map(|c| c[(i, i)].max(0.0).sqrt());
        let mut std_errors = vec![None; k];
        let mut correlations = vec![0.0; k * k];
        for &i in &known {
            std_errors[i] = deviation(i).map(|s| s * coordinates.slope(i, model.at[i]));
            for &j in &known {
                if let (Some(c), Some(si), Some(sj)) = (&covariance, deviation(i), deviation(j)) {
                    let rho = if si * sj > 0.0 { c[(i, j)] / (si * sj) } else { 0.0 };
                    correlations[i * k + j] = if i == j { 1.0 } else { rho.clamp(-1.0, 1.0) };
                }
            }
        }
        Self { std_errors, identifiable, correlations, undetermined: null.directions(coordinates, model) }
    }
}

/// `s^2 (J'WJ)^+` over the unknowns that no bound holds, zero elsewhere; `None` when no residuals are
/// left over.
fn covariance(model: &Linearisation, at_bound: &[bool], rounding: f64) -> Option<DMatrix<f64>> {
    if model.is_empty() {
        return None;
    }
    let (scaled, inverse) = unit_diagonal(model, |i| !at_bound[i]);
    let eigen = SymmetricEigen::new(scaled);
    let threshold = NULL_EIGENVALUE * eigen.eigenvalues.max();
    let inverted = eigen.eigenvalues.map(|value| if value > threshold { 1.0 / value } else { 0.0 });
    let rank = inverted.iter().filter(|&&value| value > 0.0).count();
    let left = model.count.checked_sub(rank as u64).filter(|&left| left > 0)?;
    let variance = (model.residual / left as f64).max(rounding);
    let pseudo_inverse =
        &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose();
    let k = model.len();
    Some(DMatrix::from_fn(k, k, |i, j| variance * pseudo_inverse[(i, j)] * inverse[i] * inverse[j]))
}

/// H scaled to a unit diagonal over the unknowns of `takes_part` (0 elsewhere), and the scale's
/// inverse.
fn unit_diagonal(model: &Linearisation, takes_part: impl Fn(usize) -> bool) -> (DMatrix<f64>, Vec<f64>) {
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
struct NullSpace {
    /// Unit vectors, made as sparse as elimination makes them.
    basis: Vec<Vec<f64>>,
}

impl NullSpace {
    fn of(coordinates: &Coordinates, model: &Linearisation) -> Self {
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
    fn identifiable(&self, k: usize) -> Vec<bool> {
        (0..k).map(|i| self.basis.iter().all(|v| v[i].abs() < LEAST_COMPONENT)).collect()
    }

    /// The directions in the unknowns' own units, named.
    fn directions(&self, coordinates: &Coordinates, model: &Linearisation) -> Vec<Direction> {
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

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::engine::{Point, Unknown};
    use crate::model::effects::Form;
    use crate::model::params::{Column, Param, Params};

    /// Statistics of a linear problem with unit weights whose columns are functions of noise.
    fn of(rows: usize, params: &[Param], f32_sums: bool, row: impl Fn(&[f64; 4]) -> Vec<f64>) -> Statistics {
        rounded(rows, params, f32_sums, 0.0, row)
    }

    /// The same where roundings may leave a residual of `rounding`.
    fn rounded(
        rows: usize,
        params: &[Param],
        f32_sums: bool,
        rounding: f64,
        row: impl Fn(&[f64; 4]) -> Vec<f64>,
    ) -> Statistics {
        let unknowns: Vec<Unknown> = params.iter().map(|&p| Unknown::Param(Column::tied(p))).collect();
        let point = Point { params: Params::defaults(Form::Corrected), gains: vec![] };
        let coordinates = Coordinates::new(&unknowns, &point);
        let k = params.len();
        let mut rng = StdRng::seed_from_u64(3);
        let mut hessian = vec![0.0; k * k];
        let round = |x: f64| if f32_sums { f64::from(x as f32) } else { x };
        for _ in 0..rows {
            let noise = [0; 4].map(|_| rng.random_range(-1.0..1.0_f64));
            let row: Vec<f64> = row(&noise).into_iter().map(round).collect();
            for (ij, h) in hessian.iter_mut().enumerate() {
                *h += round(row[ij / k] * row[ij % k]);
            }
        }
        let model = Linearisation {
            at: coordinates.origin().to_vec(),
            loss: 1.0,
            residual: rows as f64,
            weight: rows as f64,
            count: rows as u64,
            gradient: vec![0.0; k],
            hessian,
        };
        Statistics::new(&coordinates, &model, &vec![false; k], rounding)
    }

    const THREE: [Param; 3] = [Param::BaseWeight, Param::Hilite, Param::Reflection];

    #[test]
    fn parameters_correlated_to_a_thousandth_are_determined_and_equal_ones_are_not() {
        for f32_sums in [false, true] {
            // A second column of correlation 0.999 with the first; uniform noise has variance 1/3.
            let alike = 0.999_f64;
            let near = of(4096, &THREE, f32_sums, |n| {
                vec![n[0], alike * n[0] + (1.0 - alike * alike).sqrt() * n[1], 1e-3 * n[2]]
            });
            assert_eq!(near.identifiable, [true; 3]);
            assert!(near.undetermined.is_empty());
            // 4096 samples estimate a correlation of -0.999 to (1 - 0.999^2) / 64 = 3e-5.
            assert!((near.correlations[1] + alike).abs() < 2e-4, "{}", near.correlations[1]);

            // The second column is three times the first, whatever else there is.
            let equal = of(4096, &THREE, f32_sums, |n| vec![n[0], 3.0 * n[0], 1e-3 * n[2]]);
            assert_eq!(equal.identifiable, [false, false, true]);
            assert_eq!(equal.std_errors[..2], [None, None]);
            // (3, -1) / sqrt(10), to the rounding of 32-bit columns.
            let direction = &equal.undetermined[0].components;
            assert_eq!(equal.undetermined.len(), 1);
            assert_eq!((direction[0].0.as_str(), direction[1].0.as_str()), ("base_weight", "hilite"));
            assert!(
                (direction[0].1 - 0.9f64.sqrt()).abs() < 1e-6
                    && (direction[1].1 + 0.1f64.sqrt()).abs() < 1e-6
            );
        }
    }

    #[test]
    fn two_ambiguities_are_told_apart_and_a_zero_column_stands_alone() {
        let params =
            [Param::BaseWeight, Param::Hilite, Param::RimWeight, Param::Reflection, Param::SideSpecular];
        let known = of(1000, &params, true, |n| vec![n[0], -n[0], n[1], 2.0 * n[1], 0.0]);
        assert_eq!(known.identifiable, [false; 5]);
        let mut names: Vec<Vec<&str>> = known
            .undetermined
            .iter()
            .map(|d| d.components.iter().map(|(name, _)| name.as_str()).collect())
            .collect();
        names.iter_mut().for_each(|names| names.sort_unstable());
        names.sort();
        let expected: [&[&str]; 3] =
            [&["base_weight", "hilite"], &["reflection", "rim_weight"], &["side_specular"]];
        assert_eq!(names, expected);
    }

    #[test]
    fn standard_errors_are_those_of_least_squares() {
        // Orthogonal columns with sums of squares n/3 and 4n/3: s^2 = n / (n - 2).
        let n = 3000;
        let known = of(n, &THREE[..2], false, |noise| vec![noise[0], 2.0 * noise[1]]);
        let s = (n as f64 / (n as f64 - 2.0)).sqrt();
        for (i, size) in [1.0, 2.0].into_iter().enumerate() {
            let expected = s / (size * (n as f64 / 3.0).sqrt());
            // The sums of squares of 3000 uniform numbers vary by 1.6%, the errors by half of it.
            assert!((known.std_errors[i].unwrap() / expected - 1.0).abs() < 0.04);
        }
    }

    #[test]
    fn standard_errors_are_no_less_than_what_roundings_may_do() {
        // The residual's variance is 1: below it, roundings change nothing; above, they are what counts.
        let n = 1000;
        let of = |rounding| rounded(n, &THREE[..1], false, rounding, |noise| vec![noise[0]]).std_errors[0];
        assert_eq!(of(0.9), of(0.0));
        let ratio = of(400.0).unwrap() / of(0.0).unwrap();
        // 20 over the root of n / (n - 1).
        assert!((ratio - 20.0 * (1.0 - 1.0 / n as f64).sqrt()).abs() < 1e-9, "{ratio}");
    }

    #[test]
    fn as_many_unknowns_as_residuals_leave_no_error_to_estimate() {
        let known = of(2, &THREE[..2], false, |n| vec![n[0], n[1]]);
        assert_eq!(known.identifiable, [true; 2]);
        assert_eq!(known.std_errors, [None; 2]);
        // With fewer residuals, a direction for each unknown too many.
        let known = of(1, &THREE, false, |n| vec![n[0], n[1], n[2]]);
        assert_eq!(known.undetermined.len(), 2);
    }
}
