//! Variable projection: the linear unknowns are solved in closed form inside each step.
//!
//! Golub and Pereyra, *The differentiation of pseudo-inverses and nonlinear least squares problems
//! whose variables separate* (SIAM J. Numer. Anal. 10, 1973), in Kaufman's simplification (*A
//! variable projection method for solving separable nonlinear least squares problems*, BIT 15,
//! 1975), whose step for the non-linear unknowns is that of the joint Gauss-Newton problem at the
//! best linear unknowns (Ruhe and Wedin, *Algorithms for separable nonlinear least squares
//! problems*, SIAM Review 22, 1980).
//!
//! Let the image be `A(t) c + b(t)` with linear unknowns c and non-linear ones t. One pass at (c, t)
//! yields `A'A`, `A'r` and the blocks that couple c with t. From these follow, with no other pass:
//!
//! - the best bounded c* for this t, as A does not depend on c;
//! - the loss at (c*, t), exactly, as it is quadratic in c;
//! - `J_t' r` at (c*, t), as `J_t' (r + A (c* - c))`. The Jacobian J_t of the non-linear unknowns is
//!   affine in c, and its value at c is used for that at c*. The pass was made at the c that the
//!   step before had predicted, so c* - c is of second order in that step, and what is neglected,
//!   the change of J_t times the residual, is smaller still. Where c* - c is large (the first pass,
//!   far from the answer), [`Reduced::moved`] says so, and the solver neither trusts the model's
//!   verdict of convergence nor blames the step size without having looked again.

use super::bounded;
use super::coordinates::Coordinates;
use super::linearisation::Linearisation;

/// Which unknowns are linear.
#[derive(Clone, Debug)]
pub struct Elimination {
    linear: Vec<usize>,
}

/// A linearisation moved to the best linear unknowns.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// The model there.
    pub model: Linearisation,
    /// How far the linear unknowns moved: the largest change beside its unknown's size.
    pub moved: f64,
}

impl Elimination {
    /// Eliminate the linear ones of these unknowns.
    #[must_use]
    pub fn new(coordinates: &Coordinates) -> Self {
        let unknowns = coordinates.unknowns();
        Self { linear: (0..unknowns.len()).filter(|&i| unknowns[i].linear()).collect() }
    }

    /// Solve for the linear unknowns within their bounds, the others held.
    #[must_use]
    pub fn reduce(&self, coordinates: &Coordinates, model: &Linearisation) -> Reduced {
        let pick = |all: &[f64]| -> Vec<f64> { self.linear.iter().map(|&i| all[i]).collect() };
        let rows = self.linear.iter().map(|&i| &model.hessian[i * model.len()..]);
        let hessian: Vec<f64> = rows.flat_map(pick).collect();
        let room = coordinates.room(&model.at).of(&self.linear);
        let block = bounded::minimise(&hessian, &pick(&model.gradient), &room);
        let mut step = vec![0.0; model.len()];
        self.linear.iter().zip(&block).for_each(|(&i, &d)| step[i] = d);
        let at = coordinates.moved(&model.at, &step);
        let step: Vec<f64> = at.iter().zip(&model.at).map(|(to, from)| to - from).collect();
        let share = |&i: &usize| step[i].abs() / coordinates.size(i, model.at[i]);
        let moved = self.linear.iter().map(share).fold(0.0, f64::max);
        Reduced { model: model.moved(&step, at), moved }
    }
}
