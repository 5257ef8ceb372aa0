//! The bounded least-squares step: minimise `1/2 d'Hd + g'd` over a box, of which sums may cut a corner, exactly.
//!
//! A primal active-set method (Nocedal and Wright, *Numerical Optimization*, 2nd ed., section
//! 16.5) for the small dense matrices of normal equations. H may be singular: each subproblem is
//! solved with least norm, in variables scaled to a unit diagonal, so that whatever the data do not
//! determine stays where it is.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::room::Room;

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

/// What holds a face: a variable's bound, or a sum, by its place.
#[derive(Clone, Copy)]
enum Hold {
    Bound(usize, Place),
    Sum(usize),
}

/// The step d that minimises `1/2 d'Hd + g'd` subject to `down <= d <= up` and to the sums of `room`.
///
/// `hessian` is K x K, row-major, symmetric and positive semi-definite, with `gradient` in its
/// range, as J^T J and J^T r are. `down <= 0 <= up`, either may be infinite, and sums have room of 0 or more. A step that
/// ends on a bound equals it to the bit; one that fills a sum does so to its rounding. All values must be finite but for
/// the bounds.
#[must_use]
pub fn minimise(hessian: &[f64], gradient: &[f64], room: &Room) -> Vec<f64> {
    let mut search = Search::new(hessian, gradient, room);
    search.run();
    search.step(room)
}

/// The least-norm solution of `matrix x = right` for a symmetric positive semi-definite matrix,
/// ignoring eigenvalues below [`NULL_EIGENVALUE`] times the largest.
pub(super) fn solve_least_norm(matrix: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    solve_beside(matrix, right, 0.0)
}

/// The same where eigenvalues are compared with `size`, too.
fn solve_beside(matrix: DMatrix<f64>, right: &DVector<f64>, size: f64) -> DVector<f64> {
    let eigen = SymmetricEigen::new(matrix);
    let threshold = NULL_EIGENVALUE * eigen.eigenvalues.max().max(size);
    let mut along = eigen.eigenvectors.tr_mul(right);
    for (x, &value) in along.iter_mut().zip(&eigen.eigenvalues) {
        *x = if value > threshold { *x / value } else { 0.0 };
    }
    eigen.eigenvectors * along
}

/// The orthogonal projection onto the steps along which none of these rows moves; the rows may depend on each other.
pub(super) fn projection(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let mut projection = DMatrix::identity(rows.ncols(), rows.ncols());
    if rows.nrows() == 0 {
        return projection;
    }
    let (rows, _) = of_unit_length(rows);
    let eigen = SymmetricEigen::new(&rows * rows.transpose());
    let threshold = NULL_EIGENVALUE * eigen.eigenvalues.max();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > threshold {
            let normal = rows.tr_mul(&vector) / value.sqrt();
            projection -= &normal * normal.transpose();
        }
    }
    projection
}

/// Rows by their lengths, and these: rows of very different units hold alike. One of zeros stays, and counts as 1 long.
fn of_unit_length(rows: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let lengths: Vec<f64> = rows.row_iter().map(|row| row.norm()).collect();
    let lengths: Vec<f64> =
        lengths.into_iter().map(|length| if length > 0.0 { length } else { 1.0 }).collect();
    (DMatrix::from_fn(rows.nrows(), rows.ncols(), |s, a| rows[(s, a)] / lengths[s]), lengths)
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
    /// Of each sum: how its variables count in it, what it may be, and whether it is full and stays so.
    rows: Vec<DVector<f64>>,
    room: Vec<f64>,
    full: Vec<bool>,
}

impl Search {
    fn new(hessian: &[f64], gradient: &[f64], room: &Room) -> Self {
        let k = gradient.len();
        let (down, up) = (&room.down, &room.up);
        let scale: Vec<f64> = (0..k).map(|i| hessian[i * k + i].max(0.0).sqrt()).collect();
        let inverse: Vec<f64> = scale.iter().map(|&s| if s > 0.0 { 1.0 / s } else { 0.0 }).collect();
        let scaled_gradient = DVector::from_fn(k, |i, _| gradient[i] * inverse[i]);
        // A variable on a bound that the gradient pushes against starts as fixed there.
        let place = (0..k)
            .map(|i| match (down[i] == 0.0, up[i] == 0.0) {
                _ if scale[i] == 0.0 => Place::Fixed,
                (true, true) => Place::Fixed,
                (true, false) if gradient[i] > 0.0 => Place::Lower,
                (false, true) if gradient[i] < 0.0 => Place::Upper,
                _ => Place::Free,
            })
            .collect();
        let row = |of: &[usize]| DVector::from_fn(k, |i, _| if of.contains(&i) { inverse[i] } else { 0.0 });
        Self {
            hessian: DMatrix::from_fn(k, k, |i, j| hessian[i * k + j] * inverse[i] * inverse[j]),
            gradient: scaled_gradient,
            lower: (0..k).map(|i| down[i] * scale[i]).collect(),
            upper: (0..k).map(|i| up[i] * scale[i]).collect(),
            scale,
            z: DVector::zeros(k),
            place,
            rows: room.sums.iter().map(|sum| row(&sum.of)).collect(),
            room: room.sums.iter().map(|sum| sum.room.max(0.0)).collect(),
            full: vec![false; room.sums.len()],
        }
    }

    fn run(&mut self) {
        // Each round either adds a bound or reaches the optimum of a face, lower than the face
        // before; degenerate corners could cycle, hence the limit, after which the step is still
        // feasible and downhill.
        for _ in 0..10 * (self.place.len() + self.full.len()) + 10 {
            if self.move_within_face() && !self.release_one() {
                return;
            }
        }
    }

    fn free(&self) -> Vec<usize> {
        (0..self.place.len()).filter(|&i| self.place[i] == Place::Free).collect()
    }

    /// The rows of full sums over these variables; a sum of none of them holds nothing.
    fn full_rows(&self, free: &[usize]) -> Option<DMatrix<f64>> {
        let full: Vec<usize> = (0..self.full.len()).filter(|&s| self.full[s]).collect();
        (!full.is_empty())
            .then(|| DMatrix::from_fn(full.len(), free.len(), |s, a| self.rows[full[s]][free[a]]))
    }

    /// Go to the optimum over the free variables, or to the first bound on the way to it; whether
    /// the optimum was reached.
    fn move_within_face(&mut self) -> bool {
        let free = self.free();
        if free.is_empty() {
            return true;
        }
        let slope = &self.gradient + &self.hessian * &self.z;
        let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| self.hessian[(free[a], free[b])]);
        let right = DVector::from_fn(free.len(), |a, _| -slope[free[a]]);
        let along = match self.full_rows(&free).map(|rows| projection(&rows)) {
            // On a corner nothing but roundings is left of the matrix, whose diagonal was of 1.
            Some(face) => &face * solve_beside(&face * matrix * &face, &(&face * right), 1.0),
            None => solve_least_norm(matrix, &right),
        };
        let mut direction = DVector::zeros(self.place.len());
        free.iter().zip(&along).for_each(|(&i, &d)| direction[i] = d);
        let (reach, blocking) = self.first_bound(&free, &direction);
        for &i in &free {
            self.z[i] = (self.z[i] + reach * direction[i]).clamp(self.lower[i], self.upper[i]);
        }
        match blocking {
            Some(Hold::Bound(i, place)) => {
                self.z[i] = if place == Place::Lower { self.lower[i] } else { self.upper[i] };
                self.place[i] = place;
            }
            Some(Hold::Sum(sum)) => self.full[sum] = true,
            None => return true,
        }
        false
    }

    /// What part of `direction` can be gone, 1 at most, and what is met there.
    fn first_bound(&self, free: &[usize], direction: &DVector<f64>) -> (f64, Option<Hold>) {
        let mut first = (1.0, None);
        for &i in free {
            let d = direction[i];
            let (bound, place) =
                if d < 0.0 { (self.lower[i], Place::Lower) } else { (self.upper[i], Place::Upper) };
            let room = (bound - self.z[i]) / d;
            if d != 0.0 && room < first.0 {
                first = (room.max(0.0), Some(Hold::Bound(i, place)));
            }
        }
        for (sum, row) in self.rows.iter().enumerate().filter(|(sum, _)| !self.full[*sum]) {
            let (rate, size) = (row.dot(direction), row.component_mul(direction).abs().sum());
            let room = (self.room[sum] - row.dot(&self.z)) / rate;
            // Along a face of sums that depend on this one it rises by a rounding.
            if rate > MULTIPLIER_ROUNDING * size && room < first.0 {
                first = (room.max(0.0), Some(Hold::Sum(sum)));
            }
        }
        first
    }

    /// Free what costs most of the bounds and sums that hold; whether there is any.
    fn release_one(&mut self) -> bool {
        let mut slope = &self.gradient + &self.hessian * &self.z;
        let mut worst = None;
        let mut cost = 0.0;
        let pushes = self.pushes(&slope);
        for &(sum, push) in &pushes {
            let row = &self.rows[sum];
            let norm = row.norm();
            let terms = (0..row.len()).filter(|&i| row[i] != 0.0).map(|i| row[i] * self.size(i));
            let rounding = MULTIPLIER_ROUNDING * terms.sum::<f64>() / norm;
            if -push * norm > rounding.max(cost) {
                (cost, worst) = (-push * norm, Some(Hold::Sum(sum)));
            }
            slope.axpy(push, row, 1.0);
        }
        for i in 0..self.place.len() {
            let inward = match self.place[i] {
                Place::Lower => -1.0,
                Place::Upper => 1.0,
                Place::Free | Place::Fixed => continue,
            };
            let multiplier = inward * slope[i];
            let pushed: f64 = pushes.iter().map(|&(sum, push)| push.abs() * self.rows[sum][i]).sum();
            if multiplier > cost && multiplier > MULTIPLIER_ROUNDING * (self.size(i) + pushed) {
                (cost, worst) = (multiplier, Some(Hold::Bound(i, self.place[i])));
            }
        }
        match worst {
            Some(Hold::Bound(i, _)) => self.place[i] = Place::Free,
            Some(Hold::Sum(sum)) => self.full[sum] = false,
            None => return false,
        }
        true
    }

    /// What full sums push back by where this is the slope: of least squares where they depend on each other.
    fn pushes(&self, slope: &DVector<f64>) -> Vec<(usize, f64)> {
        let free = self.free();
        let Some(rows) = self.full_rows(&free) else { return Vec::new() };
        let of_free = DVector::from_fn(free.len(), |a, _| -slope[free[a]]);
        let (rows, lengths) = of_unit_length(&rows);
        let pushes = solve_least_norm(&rows * rows.transpose(), &(&rows * of_free));
        let full = (0..self.full.len()).filter(|&sum| self.full[sum]);
        full.zip(pushes.iter().zip(&lengths).map(|(push, length)| push / length)).collect()
    }

    /// The terms that a slope is the sum of, whatever their signs.
    fn size(&self, i: usize) -> f64 {
        let terms = self.hessian.row(i).iter().zip(&self.z).map(|(h, z)| (h * z).abs()).sum::<f64>();
        self.gradient[i].abs() + terms
    }

    fn step(&self, room: &Room) -> Vec<f64> {
        (0..self.place.len())
            .map(|i| match self.place[i] {
                Place::Lower => room.down[i],
                Place::Upper => room.up[i],
                Place::Fixed => 0.0,
                Place::Free => (self.z[i] / self.scale[i]).clamp(room.down[i], room.up[i]),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::room::Sum;
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
            let d = minimise(&h, &g, &Room::within(&lower, &upper));
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
            let best = minimise(&h, &g, &Room::within(&lower, &upper));
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

    /// The same in one unit, each variable in one of two sums or in none.
    fn summed() -> impl Strategy<Value = (Vec<f64>, Vec<f64>, Room)> {
        (problem(), proptest::collection::vec(0_usize..3, 9), proptest::array::uniform2(0.0..1.0_f64))
            .prop_map(|((k, h, g, lower, upper), group, left)| {
                let unit: Vec<f64> = (0..k).map(|i| h[i * k + i].sqrt().max(1e-9)).collect();
                let room = Room {
                    down: (0..k).map(|i| lower[i] * unit[i]).collect(),
                    up: (0..k).map(|i| upper[i] * unit[i]).collect(),
                    sums: (1..3)
                        .map(|s| Sum {
                            of: (0..k).filter(|&i| group[i] == s).collect(),
                            // A third of them have no room at all.
                            room: (1.5 * left[s - 1] - 0.5).max(0.0),
                        })
                        .collect(),
                };
                let g = (0..k).map(|i| g[i] / unit[i]).collect();
                let h = (0..k * k).map(|ij| h[ij] / unit[ij / k] / unit[ij % k]).collect();
                (h, g, room)
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]
        #[test]
        fn a_step_within_sums_meets_the_kkt_conditions((h, g, room) in summed()) {
            let k = g.len();
            let d = minimise(&h, &g, &room);
            let least = SymmetricEigen::new(DMatrix::from_row_slice(k, k, &h)).eigenvalues.min();
            let tolerance = if least > 1e-5 { 1e-9 } else { 2e-4 * (k as f64) };
            let mut push = vec![(0.0_f64, 0.0_f64); k];
            for sum in &room.sums {
                let total: f64 = sum.of.iter().map(|&i| d[i]).sum();
                // Rounding of nine numbers, of which none is above some thousands.
                prop_assert!(total <= sum.room + 1e-9, "{total} > {}", sum.room);
                let full = total >= sum.room - 1e-9;
                sum.of.iter().for_each(|&i| push[i] = (0.0, if full { f64::INFINITY } else { 0.0 }));
            }
            // What each variable allows a sum that holds it to push by: all of a sum must agree.
            let mut allowed = push.clone();
            for i in 0..k {
                prop_assert!((room.down[i]..=room.up[i]).contains(&d[i]));
                let terms: Vec<f64> = (0..k).map(|j| h[i * k + j] * d[j]).collect();
                let slope = g[i] + terms.iter().sum::<f64>();
                let within = tolerance * (1.0 + terms.iter().map(|t| t.abs()).sum::<f64>());
                if d[i] > room.down[i] {
                    allowed[i].1 = allowed[i].1.min(-slope + within);
                }
                if d[i] < room.up[i] {
                    allowed[i].0 = allowed[i].0.max(-slope - within);
                }
            }
            let alone = |i: &usize| !room.sums.iter().any(|sum| sum.of.contains(i));
            for i in (0..k).filter(alone) {
                prop_assert!(allowed[i].0 <= allowed[i].1 + 2.0 * tolerance, "{i}: {:?}", allowed[i]);
            }
            for sum in &room.sums {
                let least = sum.of.iter().map(|&i| allowed[i].0).fold(0.0, f64::max);
                let most = sum.of.iter().map(|&i| allowed[i].1).fold(f64::INFINITY, f64::min);
                prop_assert!(least <= most + 2.0 * tolerance, "{:?}: {least} > {most}", sum.of);
            }
        }

        #[test]
        fn no_point_within_sums_is_lower((h, g, room) in summed(), seed in any::<u64>()) {
            use rand::{RngExt, SeedableRng};
            let k = g.len();
            let value = |d: &[f64]| {
                let hd = |i: usize| (0..k).map(|j| h[i * k + j] * d[j]).sum::<f64>();
                (0..k).map(|i| d[i] * (g[i] + 0.5 * hd(i))).sum::<f64>()
            };
            let best = minimise(&h, &g, &room);
            let mut rng = rand::rngs::StdRng::seed_from_u64(seed);
            for _ in 0..50 {
                let near = |i: usize| best[i] + rng.random_range(-0.1..0.1_f64);
                let mut other: Vec<f64> =
                    (0..k).map(near).zip(room.down.iter().zip(&room.up)).map(|(d, (a, b))| d.clamp(*a, *b)).collect();
                room.cut(&mut other);
                // Left-out directions cost at most sqrt(1e-8) |r| each over a move of 0.1 units.
                prop_assert!(value(&best) <= value(&other) + 1e-4, "{} > {}", value(&best), value(&other));
            }
        }
    }

    #[test]
    fn a_full_sum_shares_what_it_has_and_gives_way_where_it_does_not_pay() {
        let h = [1.0, 0.0, 0.0, 1.0];
        let far = [f64::INFINITY; 2];
        let held = |g: [f64; 2], room: f64| {
            let sums = vec![Sum { of: vec![0, 1], room }];
            minimise(&h, &g, &Room { sums, ..Room::within(&far.map(|b: f64| -b), &far) })
        };
        // The nearest of x + y = 1 to (2, 1): both lose 1. And to (2, -3) nothing is lost, as it has room.
        let near = |d: Vec<f64>, wanted: [f64; 2]| (0..2).all(|i| (d[i] - wanted[i]).abs() < 1e-12);
        assert!(near(held([-2.0, -1.0], 1.0), [1.0, 0.0]));
        assert!(near(held([-2.0, 3.0], 1.0), [2.0, -3.0]));
        assert!(near(held([-2.0, -1.0], 0.0), [0.5, -0.5]));
        // Two sums that say the same, and one of which no variable is free.
        let twice = vec![Sum { of: vec![0, 1], room: 1.0 }; 2];
        let room = Room { sums: twice, ..Room::within(&[0.0; 2], &far) };
        assert!(near(minimise(&h, &[-2.0, -1.0], &room), [1.0, 0.0]));
        let room = Room { up: vec![0.0; 2], ..room };
        assert_eq!(minimise(&h, &[-2.0, -1.0], &room), [0.0; 2]);
    }

    #[test]
    fn an_unbounded_regular_step_is_the_newton_step() {
        let h = [4.0, 1.0, 1.0, 3.0];
        let d = minimise(&h, &[-1.0, -2.0], &Room::within(&[f64::NEG_INFINITY; 2], &[f64::INFINITY; 2]));
        // By Cramer's rule: (1*3 - 2*1)/11, (4*2 - 1*1)/11; two roundings.
        assert!((d[0] - 1.0 / 11.0).abs() < 1e-15 && (d[1] - 7.0 / 11.0).abs() < 1e-15, "{d:?}");
    }

    #[test]
    fn what_nothing_depends_on_does_not_move_and_twins_share_the_step() {
        // Columns 0 and 1 are equal, column 2 is zero.
        let h = [1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        let free = [f64::INFINITY; 3];
        let d = minimise(&h, &[-2.0, -2.0, 0.0], &Room::within(&free.map(|b: f64| -b), &free));
        assert!((d[0] - 1.0).abs() < 1e-14 && (d[1] - 1.0).abs() < 1e-14, "{d:?}");
        assert_eq!(d[2], 0.0);
        // With the first held back, the second does all of it.
        let d = minimise(&h, &[-2.0, -2.0, 0.0], &Room::within(&[0.0; 3], &[0.25, f64::INFINITY, 1.0]));
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
        let d = DVector::from_vec(minimise(h.as_slice(), g.as_slice(), &Room::within(&lower, &upper)));
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
