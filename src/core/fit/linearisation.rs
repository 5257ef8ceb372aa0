//! Loss and normal equations in solver coordinates: the quadratic model that a step is made from.

use std::cell::Cell;

use serde::{Deserialize, Serialize};

use super::coordinates::Coordinates;
use crate::engine::Objective;

/// What one pass over the samples says about the neighbourhood of a point.
///
/// The loss after a step d is modelled as `loss + (2 g'd + d'Hd) / weight`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linearisation {
    /// The point's coordinates.
    pub at: Vec<f64>,
    /// The loss there.
    pub loss: f64,
    /// Sum of weighted squared residuals (of a robust loss: reweighted).
    pub residual: f64,
    /// Sum of the residuals' weights.
    pub weight: f64,
    /// How many residuals count.
    pub count: u64,
    /// g = J^T r.
    pub gradient: Vec<f64>,
    /// H = J^T J, row-major.
    pub hessian: Vec<f64>,
}

impl Linearisation {
    /// How many unknowns there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.at.len()
    }

    /// Whether there are no unknowns.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.at.is_empty()
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.loss.is_finite()
            && self.residual.is_finite()
            && self.gradient.iter().chain(&self.hessian).all(|x| x.is_finite())
    }

    /// Whether H may be a J^T J: by the Cauchy-Schwarz inequality `|H_ij| <= sqrt(H_ii H_jj)`. Sums of f32 products keep
    /// it to some 1e-6, and but for products that are too small for an f32.
    #[must_use]
    pub fn is_of_products(&self) -> bool {
        let k = self.len();
        let least = 1e-15 * (0..k).map(|i| self.curvature(i)).fold(0.0, f64::max);
        let most = |i: usize, j: usize| 1.001 * self.curvature(i).sqrt() * self.curvature(j).sqrt() + least;
        (0..k * k).all(|ij| self.hessian[ij].abs() <= most(ij / k, ij % k))
    }

    /// H's diagonal element `i`.
    #[must_use]
    pub fn curvature(&self, i: usize) -> f64 {
        self.hessian[i * self.len() + i].max(0.0)
    }

    /// `d'Hd`: the sum of squares by which the step changes the weighted image.
    #[must_use]
    pub fn image_change(&self, step: &[f64]) -> f64 {
        step.iter().zip(self.hessian_times(step)).map(|(d, hd)| d * hd).sum::<f64>().max(0.0)
    }

    /// By how much the model of the loss says that a step changes it.
    #[must_use]
    pub fn change(&self, step: &[f64]) -> f64 {
        self.residual_change(step) / self.weight
    }

    /// The model moved to another point: exact, but for the Jacobian, which stays the old one's.
    #[must_use]
    pub fn moved(&self, step: &[f64], at: Vec<f64>) -> Self {
        let change = self.residual_change(step);
        let gradient = self.gradient.iter().zip(self.hessian_times(step)).map(|(g, hd)| g + hd).collect();
        Self {
            at,
            loss: (self.loss + change / self.weight).max(0.0),
            residual: (self.residual + change).max(0.0),
            gradient,
            hessian: self.hessian.clone(),
            ..*self
        }
    }

    fn residual_change(&self, step: &[f64]) -> f64 {
        let terms = self.gradient.iter().zip(self.hessian_times(step)).zip(step);
        terms.map(|((g, hd), d)| d * (2.0 * g + hd)).sum()
    }

    fn hessian_times<'a>(&'a self, step: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.hessian.chunks(self.len().max(1)).map(move |row| row.iter().zip(step).map(|(h, d)| h * d).sum())
    }
}

/// Why an engine cannot go on, in its words.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct EngineFault(pub String);

/// An objective that is seen in solver coordinates, and whose passes are counted.
pub struct Passes<'a> {
    objective: &'a dyn Objective,
    coordinates: &'a Coordinates,
    count: Cell<u64>,
}

impl<'a> Passes<'a> {
    /// `count`: passes that were made before an interruption.
    #[must_use]
    pub fn new(objective: &'a dyn Objective, coordinates: &'a Coordinates, count: u64) -> Self {
        Self { objective, coordinates, count: Cell::new(count) }
    }

    /// How many passes were made.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count.get()
    }

    /// The coordinates.
    #[must_use]
    pub fn coordinates(&self) -> &'a Coordinates {
        self.coordinates
    }

    /// That passes can still be made.
    ///
    /// # Errors
    /// When the engine says that they cannot.
    pub fn check(&self) -> Result<(), EngineFault> {
        self.objective.fault().map_or(Ok(()), |reason| Err(EngineFault(reason)))
    }

    /// Whether the objective is exactly quadratic in its linear unknowns.
    #[must_use]
    pub fn is_quadratic(&self) -> bool {
        self.objective.is_quadratic()
    }

    /// One pass: loss and normal equations.
    #[must_use]
    pub fn linearise(&self, at: &[f64]) -> Linearisation {
        self.count.set(self.count.get() + 1);
        let equations = self.objective.normal_equations(&self.coordinates.point(at));
        let k = at.len();
        let slope: Vec<f64> = (0..k).map(|i| self.coordinates.slope(i, at[i])).collect();
        Linearisation {
            at: at.to_vec(),
            loss: equations.loss,
            residual: equations.residual,
            weight: equations.weight,
            count: equations.count,
            gradient: (0..k).map(|i| equations.jtr[i] * slope[i]).collect(),
            hessian: (0..k * k).map(|ij| equations.jtj[ij] * slope[ij / k] * slope[ij % k]).collect(),
        }
    }

    /// One pass: the loss alone.
    #[must_use]
    pub fn loss(&self, at: &[f64]) -> f64 {
        self.count.set(self.count.get() + 1);
        self.objective.loss(&self.coordinates.point(at))
    }

    /// One pass: the loss and its gradient.
    #[must_use]
    pub fn gradient(&self, at: &[f64]) -> (f64, Vec<f64>) {
        self.count.set(self.count.get() + 1);
        let (loss, mut gradient) = self.objective.gradient(&self.coordinates.point(at));
        for (i, g) in gradient.iter_mut().enumerate() {
            *g *= self.coordinates.slope(i, at[i]);
        }
        (loss, gradient)
    }
}
