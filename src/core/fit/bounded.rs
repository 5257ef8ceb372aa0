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
mod tests;
