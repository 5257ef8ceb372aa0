//! The bounded least-squares step: minimise `1/2 d'Hd + g'd` over a box, exactly.
//!
//! A primal active-set method (Nocedal and Wright, *Numerical Optimization*, 2nd ed., section
//! 16.5) for the small dense matrices of normal equations. H may be singular: each subproblem is
//! solved with least norm, in variables scaled to a unit diagonal, so that whatever the data do not
//! determine stays where it is.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Below this share of the largest eigenvalue of the unit-diagonal J^T J, a direction is taken as
/// undetermined.
///
/// The sums behind J^T J come from 32-bit floats folded in 64 bits: each product carries a relative
/// rounding error of 6e-8, which averages out over n residuals to about 6e-8 / sqrt(n) and, with
/// what does not average, to some 1e-9 at a few thousand pixels. An eigenvalue well below 1e-8 thus
/// cannot be told from 0, whereas two parameters correlated to 0.999 have one of 1e-3.
pub const NULL_EIGENVALUE: f64 = 1e-8;

/// Multipliers below this share of the terms that they are the sum of are rounding.
const MULTIPLIER_ROUNDING: f64 = 1e-12;

/// Where a variable stands during the search.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Free,
    Lower,
    Upper,
    /// Nothing depends on it, or its bounds coincide: it never moves.
    Fixed,
}

/// The step d that minimises `1/2 d'Hd + g'd` subject to `lower <= d <= upper`.
///
/// `hessian` is K x K, row-major, symmetric and positive semi-definite, with `gradient` in its
/// range, as J^T J and J^T r are. `lower <= 0 <= upper`, either may be infinite. A step that ends on
/// a bound equals it to the bit. All values must be finite but for the bounds.
#[must_use]
pub fn minimise(hessian: &[f64], gradient: &[f64], lower: &[f64], upper: &[f64]) -> Vec<f64> {
    let mut search = Search::new(hessian, gradient, lower, upper);
    search.run();
    search.step(lower, upper)
}

/// The least-norm solution of `matrix x = right` for a symmetric positive semi-definite matrix,
/// ignoring eigenvalues below [`NULL_EIGENVALUE`] times the largest.
pub(super) fn solve_least_norm(matrix: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let eigen = SymmetricEigen::new(matrix);
    let threshold = NULL_EIGENVALUE * eigen.eigenvalues.max();
    let mut along = eigen.eigenvectors.tr_mul(right);
    for (x, &value) in along.iter_mut().zip(&eigen.eigenvalues) {
        *x = if value > threshold { *x / value } else { 0.0 };
    }
    eigen.eigenvectors * along
}

/// The problem in variables `z = scale * d`, for which H has a unit diagonal.
struct Search {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    scale: Vec<f64>,
    z: DVector<f64>,
    place: Vec<Place>,
}

impl Search {
    fn new(hessian: &[f64], gradient: &[f64], lower: &[f64], upper: &[f64]) -> Self {
        let k = gradient.len();
        let scale: Vec<f64> = (0..k).map(|i| hessian[i * k + i].max(0.0).sqrt()).collect();
        let inverse: Vec<f64> = scale.iter().map(|&s| if s > 0.0 { 1.0 / s } else { 0.0 }).collect();
        let scaled_gradient = DVector::from_fn(k, |i, _| gradient[i] * inverse[i]);
        // A variable on a bound that the gradient pushes against starts as fixed there.
        let place = (0..k)
            .map(|i| match (lower[i] == 0.0, upper[i] == 0.0) {
                _ if scale[i] == 0.0 => Place::Fixed,
                (true, true) => Place::Fixed,
                (true, false) if gradient[i] > 0.0 => Place::Lower,
                (false, true) if gradient[i] < 0.0 => Place::Upper,
                _ => Place::Free,
            })
            .collect();
        Self {
            hessian: DMatrix::from_fn(k, k, |i, j| hessian[i * k + j] * inverse[i] * inverse[j]),
            gradient: scaled_gradient,
            lower: (0..k).map(|i| lower[i] * scale[i]).collect(),
            upper: (0..k).map(|i| upper[i] * scale[i]).collect(),
            scale,
            z: DVector::zeros(k),
            place,
        }
    }

    fn run(&mut self) {
        // Each round either adds a bound or reaches the optimum of a face, lower than the face
        // before; degenerate corners could cycle, hence the limit, after which the step is still
        // feasible and downhill.
        for _ in 0..10 * self.place.len() + 10 {
            if self.move_within_face() && !self.release_one() {
                return;
            }
        }
    }

    /// Go to the optimum over the free variables, or to the first bound on the way to it; whether
    /// the optimum was reached.
    fn move_within_face(&mut self) -> bool {
        let free: Vec<usize> = (0..self.place.len()).filter(|&i| self.place[i] == Place::Free).collect();
        if free.is_empty() {
            return true;
        }
        let slope = &self.gradient + &self.hessian * &self.z;
        let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| self.hessian[(free[a], free[b])]);
        let right = DVector::from_fn(free.len(), |a, _| -slope[free[a]]);
        let direction = solve_least_norm(matrix, &right);
        let mut reach = 1.0;
        let mut blocking = None;
        for (&i, &d) in free.iter().zip(&direction) {
            let (bound, place) =
                if d < 0.0 { (self.lower[i], Place::Lower) } else { (self.upper[i], Place::Upper) };
            let room = (bound - self.z[i]) / d;
            if d != 0.0 && room < reach {
                (reach, blocking) = (room.max(0.0), Some((i, place, bound)));
            }
        }
        for (&i, &d) in free.iter().zip(&direction) {
            self.z[i] = (self.z[i] + reach * d).clamp(self.lower[i], self.upper[i]);
        }
        let Some((i, place, bound)) = blocking else { return true };
        self.z[i] = bound;
        self.place[i] = place;
        false
    }

    /// Free the variable whose bound costs most; whether there is any.
    fn release_one(&mut self) -> bool {
        let mut worst = None;
        let mut cost = 0.0;
        for i in 0..self.place.len() {
            let inward = match self.place[i] {
                Place::Lower => -1.0,
                Place::Upper => 1.0,
                Place::Free | Place::Fixed => continue,
            };
            let terms = self.hessian.row(i).transpose().component_mul(&self.z);
            let multiplier = inward * (self.gradient[i] + terms.sum());
            let rounding = MULTIPLIER_ROUNDING * (self.gradient[i].abs() + terms.abs().sum());
            if multiplier > rounding && multiplier > cost {
                (cost, worst) = (multiplier, Some(i));
            }
        }
        if let Some(i) = worst {
            self.place[i] = Place::Free;
        }
        worst.is_some()
    }

    fn step(&self, lower: &[f64], upper: &[f64]) -> Vec<f64> {
        (0..self.place.len())
            .map(|i| match self.place[i] {
                Place::Lower => lower[i],
                Place::Upper => upper[i],
                Place::Fixed => 0.0,
                Place::Free => (self.z[i] / self.scale[i]).clamp(lower[i], upper[i]),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// H = J'J and g = J'r of random J, r with `rows` rows (fewer than K: singular), whose columns
    /// have very different units.
    fn problem() -> impl Strategy<Value = (usize, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>)> {
        (1_usize..9, 1_usize..14).prop_flat_map(|(k, rows)| {
            let jacobian = proptest::collection::vec(-1.0..1.0_f64, rows * k);
            let residual = proptest::collection::vec(-1.0..1.0_f64, rows);
            let units = proptest::collection::vec(-3..4_i32, k);
            let bound = || prop_oneof![Just(0.0), Just(f64::INFINITY), 0.0..1.0_f64];
            let lower = proptest::collection::vec(bound(), k);
            let upper = proptest::collection::vec(bound(), k);
            (jacobian, residual, units, lower, upper).prop_map(move |(j, r, units, lower, upper)| {
                let unit: Vec<f64> = units.iter().map(|&u| 10_f64.powi(u)).collect();
                let j = DMatrix::from_fn(rows, k, |row, col| j[row * k + col] * unit[col]);
                let h = j.tr_mul(&j);
                let g = j.tr_mul(&DVector::from_vec(r));
                let lower = lower.iter().zip(&unit).map(|(b, u)| -b / u).collect();
                let upper = upper.iter().zip(&unit).map(|(b, u)| b / u).collect();
                (k, h.as_slice().to_vec(), g.as_slice().to_vec(), lower, upper)
            })
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]
        #[test]
        fn the_step_meets_the_kkt_conditions((k, h, g, lower, upper) in problem()) {
            let d = minimise(&h, &g, &lower, &upper);
            let unit = |i: usize| 1.0 / h[i * k + i].sqrt();
            let scaled = DMatrix::from_fn(k, k, |i, j| h[i * k + j] * unit(i) * unit(j));
            let least = SymmetricEigen::new(scaled).eigenvalues.min();
            for i in 0..k {
                prop_assert!((lower[i]..=upper[i]).contains(&d[i]));
                let terms: Vec<f64> = (0..k).map(|j| h[i * k + j] * d[j]).collect();
                let slope = g[i] + terms.iter().sum::<f64>();
                let size = h[i * k + i].sqrt() + terms.iter().map(|t| t.abs()).sum::<f64>();
                // Rounding of a well-conditioned system; else directions below 1e-8 of the largest
                // eigenvalue are left out, and with them a slope of up to sqrt(1e-8) |J| |r|.
                let tolerance = size * if least > 1e-5 { 1e-10 } else { 2e-4 * (k as f64) };
                if d[i] > lower[i] {
                    prop_assert!(slope <= tolerance, "{i}: {slope} at {}", d[i]);
                }
                if d[i] < upper[i] {
                    prop_assert!(slope >= -tolerance, "{i}: {slope} at {}", d[i]);
                }
            }
        }

        #[test]
        fn no_feasible_point_is_lower((k, h, g, lower, upper) in problem(), seed in any::<u64>()) {
            use rand::{RngExt, SeedableRng};
            let value = |d: &[f64]| {
                let hd = |i: usize| (0..k).map(|j| h[i * k + j] * d[j]).sum::<f64>();
                (0..k).map(|i| d[i] * (g[i] + 0.5 * hd(i))).sum::<f64>()
            };
            let best = minimise(&h, &g, &lower, &upper);
            let mut rng = rand::rngs::StdRng::seed_from_u64(seed);
            for _ in 0..50 {
                let unit = |i: usize| 1.0 / h[i * k + i].sqrt().max(1e-9);
                let other: Vec<f64> = (0..k)
                    .map(|i| (best[i] + unit(i) * rng.random_range(-0.1..0.1_f64)).clamp(lower[i], upper[i]))
                    .collect();
                // Left-out directions cost at most sqrt(1e-8) |r| each over a move of 0.1 units.
                prop_assert!(value(&best) <= value(&other) + 1e-4, "{} > {}", value(&best), value(&other));
            }
        }
    }

    #[test]
    fn an_unbounded_regular_step_is_the_newton_step() {
        let h = [4.0, 1.0, 1.0, 3.0];
        let d = minimise(&h, &[-1.0, -2.0], &[f64::NEG_INFINITY; 2], &[f64::INFINITY; 2]);
        // By Cramer's rule: (1*3 - 2*1)/11, (4*2 - 1*1)/11; two roundings.
        assert!((d[0] - 1.0 / 11.0).abs() < 1e-15 && (d[1] - 7.0 / 11.0).abs() < 1e-15, "{d:?}");
    }

    #[test]
    fn what_nothing_depends_on_does_not_move_and_twins_share_the_step() {
        // Columns 0 and 1 are equal, column 2 is zero.
        let h = [1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        let free = [f64::INFINITY; 3];
        let d = minimise(&h, &[-2.0, -2.0, 0.0], &free.map(|b: f64| -b), &free);
        assert!((d[0] - 1.0).abs() < 1e-14 && (d[1] - 1.0).abs() < 1e-14, "{d:?}");
        assert_eq!(d[2], 0.0);
        // With the first held back, the second does all of it.
        let d = minimise(&h, &[-2.0, -2.0, 0.0], &[0.0; 3], &[0.25, f64::INFINITY, 1.0]);
        assert_eq!(d[0], 0.25);
        assert!((d[1] - 1.75).abs() < 1e-14, "{d:?}");
    }

    #[test]
    fn sixty_four_unknowns_on_random_bounds_end_on_a_kkt_point() {
        use rand::{RngExt, SeedableRng};
        let k = 64;
        let mut rng = rand::rngs::StdRng::seed_from_u64(5);
        let j = DMatrix::from_fn(200, k, |_, _| rng.random_range(-1.0..1.0_f64));
        let h = j.tr_mul(&j);
        let g = j.tr_mul(&DVector::from_fn(200, |_, _| rng.random_range(-1.0..1.0_f64)));
        let upper: Vec<f64> = (0..k).map(|_| rng.random_range(0.0..0.05)).collect();
        let lower: Vec<f64> = upper.iter().map(|u| -u).collect();
        let d = DVector::from_vec(minimise(h.as_slice(), g.as_slice(), &lower, &upper));
        let slope = &g + &h * &d;
        let on_bound = (0..k).filter(|&i| d[i] == lower[i] || d[i] == upper[i]).count();
        assert!((5..60).contains(&on_bound), "the test should mix free and bound: {on_bound}");
        for i in 0..k {
            // Well-conditioned: rounding of 64 terms of size ~10.
            assert!(d[i] == lower[i] || slope[i] < 1e-11, "{i}");
            assert!(d[i] == upper[i] || slope[i] > -1e-11, "{i}");
        }
    }
}
