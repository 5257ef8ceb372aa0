//! Gauss-Newton steps that learn what J^T J leaves out of the loss' curvature.
//!
//! Where residuals are noise, second derivatives weigh enough along directions that the data hardly determine to slow
//! Gauss-Newton to a steady factor. What gradients show of them is added as symmetric rank-one updates (Dennis, Gay and
//! Welsch, *An adaptive nonlinear least-squares algorithm*, 1981; Nocedal and Wright, *Numerical Optimization*, section 6.2).

use nalgebra::{DMatrix, DVector};
use skinfit::engine::{Objective, Point};
use skinfit::fit::bounded;
use skinfit::fit::coordinates::Coordinates;

/// A fit on its way.
pub(super) struct Secant {
    coordinates: Coordinates,
    at: Vec<f64>,
    /// What J^T J leaves out.
    beyond: DMatrix<f64>,
    last: Option<Last>,
}

/// The last pass, and the step that was made from it.
struct Last {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    step: DVector<f64>,
}

impl Secant {
    /// From a point on.
    pub(super) fn new(engine: &dyn Objective, point: &Point) -> Self {
        let coordinates = Coordinates::new(engine.unknowns(), point);
        let at = coordinates.origin().to_vec();
        let beyond = DMatrix::zeros(at.len(), at.len());
        Self { coordinates, at, beyond, last: None }
    }

    /// A pass, and a bounded step to a next point.
    pub(super) fn step(&mut self, engine: &dyn Objective) -> Point {
        let sums = engine.normal_equations(&self.coordinates.point(&self.at));
        let k = self.at.len();
        let slope: Vec<f64> = (0..k).map(|i| self.coordinates.slope(i, self.at[i])).collect();
        let hessian = DMatrix::from_fn(k, k, |i, j| sums.jtj[i * k + j] * slope[i] * slope[j]);
        let gradient = DVector::from_fn(k, |i, _| sums.jtr[i] * slope[i]);
        if let Some(last) = &self.last {
            let between = (&hessian + &last.hessian) * 0.5;
            let unknown = &gradient - &last.gradient - (between + &self.beyond) * &last.step;
            let along = unknown.dot(&last.step);
            // Along other directions it would be a guess.
            if along.abs() > 1e-3 * unknown.norm() * last.step.norm() {
                self.beyond += &unknown * unknown.transpose() / along;
            }
        }
        let curved = &hessian + &self.beyond;
        let hessian_of_step = if curved.clone().cholesky().is_some() { &curved } else { &hessian };
        let room = self.coordinates.room(&self.at);
        let step = bounded::minimise(hessian_of_step.as_slice(), gradient.as_slice(), &room);
        let at = self.coordinates.moved(&self.at, &step);
        let step = DVector::from_fn(k, |i, _| at[i] - self.at[i]);
        self.last = Some(Last { hessian, gradient, step });
        self.at = at;
        self.coordinates.point(&self.at)
    }
}
