//! What the normal equations say of an answer: standard errors, correlations, and what the images
//! cannot determine.
//!
//! With weights w, residuals r and n of them above weight 0, and K the rank of J over the unknowns
//! that no bound holds (along shares of a whole that add up to all of it, where such are):
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
//! That is the *noise error*: it holds for residuals that are independent, of variance in inverse proportion to w. Where a
//! model misses what an image shows, neighbouring residuals are alike, and the true errors are greater: then the
//! [`sandwich`](super::sandwich) of squares of pixels has them. The *standard error* is the greater of the two: with few
//! squares a sandwich is as often too small as too large, and of independent residuals both are the same but for that.
//! Where roundings are all that is left there is none, as they are no draws.
//!
//! Both take the image as linear in the unknowns over a standard error; [`profile`](super::profile) does not. A robust
//! loss enters by its reweighted quadratic. Correlations are those of independent residuals.

use nalgebra::{DMatrix, SymmetricEigen};

use super::bounded::{NULL_EIGENVALUE, projection};
use super::coordinates::Coordinates;
use super::error_basis::ErrorBasis;
use super::linearisation::Linearisation;
use super::null_space::{NullSpace, unit_diagonal};
use super::outcome::Direction;
use super::sandwich::sandwich;
use crate::engine::pulls::Pulls;

/// What is known of an answer, in the order of the unknowns.
#[derive(Clone, Debug)]
pub struct Statistics {
    /// One standard error, in the unknown's own unit; `None` when unidentifiable, at a bound, or
    /// without residuals to spare.
    pub std_errors: Vec<Option<f64>>,
    /// The same if residuals were independent.
    pub noise_errors: Vec<Option<f64>>,
    /// What is known of neighbouring residuals.
    pub basis: ErrorBasis,
    /// Whether the images determine the unknown.
    pub identifiable: Vec<bool>,
    /// K x K, row-major; 0 beside unknowns without a standard error.
    pub correlations: Vec<f64>,
    /// What they do not.
    pub undetermined: Vec<Direction>,
    /// The diagonal of (J'WJ)^+ in coordinates: variances of unknowns where residuals have the variance 1.
    pub(super) unit: Vec<f64>,
}

impl Statistics {
    /// What `model` says of an answer of which the unknowns of `at_bound` are held by their bounds;
    /// `rounding` is what roundings may leave of its residual, and `pulls` what is known of where residuals stand.
    #[must_use]
    pub fn new(
        coordinates: &Coordinates,
        model: &Linearisation,
        at_bound: &[bool],
        rounding: f64,
        pulls: Option<&Pulls>,
    ) -> Self {
        let k = model.len();
        let null = NullSpace::of(coordinates, model);
        let identifiable = null.identifiable(k);
        let known: Vec<usize> = (0..k).filter(|&i| identifiable[i] && !at_bound[i]).collect();
        let slope: Vec<f64> = (0..k).map(|i| coordinates.slope(i, model.at[i])).collect();
        let Inverse { matrix, rank } = inverse(model, at_bound, coordinates);
        let left = model.count.checked_sub(rank as u64).filter(|&left| left > 0);
        let variance = left.map(|left| (model.residual / left as f64).max(rounding));
        let is_rounding = left.is_some_and(|left| model.residual / left as f64 <= rounding);
        let clustered =
            pulls.filter(|_| left.is_some() && !is_rounding).and_then(|p| sandwich(&matrix, p, &slope));
        let (mut std_errors, mut noise_errors) = (vec![None; k], vec![None; k]);
        let mut correlations = vec![0.0; k * k];
        let root = |x: f64| x.max(0.0).sqrt();
        for &i in &known {
            let Some(variance) = variance else { continue };
            let noise = root(variance * matrix[(i, i)]) * slope[i];
            let apart = clustered.as_ref().map_or(0.0, |(c, _)| root(c[(i, i)]) * slope[i]);
            // What overflows tells as little as what is not determined.
            if !noise.max(apart).is_finite() {
                continue;
            }
            (noise_errors[i], std_errors[i]) = (Some(noise), Some(noise.max(apart)));
            for &j in &known {
                let size = root(matrix[(i, i)]) * root(matrix[(j, j)]);
                let rho = if size > 0.0 { matrix[(i, j)] / size } else { 0.0 };
                correlations[i * k + j] = if i == j { 1.0 } else { rho.clamp(-1.0, 1.0) };
            }
        }
        let basis = match clustered {
            Some((_, blocks)) => ErrorBasis::Blocks(blocks),
            None if is_rounding => ErrorBasis::Rounding,
            None => ErrorBasis::Independent,
        };
        let undetermined = null.directions(coordinates, model);
        let unit = (0..k).map(|i| matrix[(i, i)].max(0.0)).collect();
        Self { std_errors, noise_errors, basis, identifiable, correlations, undetermined, unit }
    }
}

/// A pseudo-inverse, and the rank of what it is of.
struct Inverse {
    matrix: DMatrix<f64>,
    rank: usize,
}

/// `(J'WJ)^+` over the unknowns that no bound holds, zero elsewhere; along steps that leave full sums of shares as they
/// are.
fn inverse(model: &Linearisation, at_bound: &[bool], coordinates: &Coordinates) -> Inverse {
    let k = model.len();
    if model.is_empty() {
        return Inverse { matrix: DMatrix::zeros(k, k), rank: 0 };
    }
    let (scaled, inverse) = unit_diagonal(model, |i| !at_bound[i]);
    let full: Vec<&[usize]> = coordinates.full(&model.at).collect();
    let rows = DMatrix::from_fn(full.len(), k, |s, i| if full[s].contains(&i) { inverse[i] } else { 0.0 });
    let face = projection(&rows);
    let eigen = SymmetricEigen::new(if full.is_empty() { scaled } else { &face * scaled * &face });
    // On a corner nothing but roundings is left of the matrix, whose diagonal was of 1.
    let size = if full.is_empty() { 0.0 } else { 1.0 };
    let threshold = NULL_EIGENVALUE * eigen.eigenvalues.max().max(size);
    let inverted = eigen.eigenvalues.map(|value| if value > threshold { 1.0 / value } else { 0.0 });
    let rank = inverted.iter().filter(|&&value| value > 0.0).count();
    let pseudo_inverse =
        &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose();
    let matrix = DMatrix::from_fn(k, k, |i, j| pseudo_inverse[(i, j)] * inverse[i] * inverse[j]);
    Inverse { matrix, rank }
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
        Statistics::new(&coordinates, &model, &vec![false; k], rounding, None)
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
