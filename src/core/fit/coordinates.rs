//! The coordinates that solvers step in: an unknown's value, or its logarithm where the parameter
//! table says that its ratio is what matters.

use crate::engine::{Point, Unknown};
use crate::model::bounds::Bounds;
use crate::model::params::Scale;

/// The map between points and vectors of solver coordinates.
#[derive(Clone, Debug)]
pub struct Coordinates {
    unknowns: Vec<Unknown>,
    origin: Point,
    at_origin: Vec<f64>,
    /// Least and greatest value of each.
    bounds: Vec<(f64, f64)>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Coordinates {
    /// The coordinates of `unknowns`, within the table's bounds; everything else stays as it is at `origin`.
    #[must_use]
    pub fn new(unknowns: &[Unknown], origin: &Point) -> Self {
        Self::within(unknowns, origin, &[])
    }

    /// The same within what scenes set ([`Unknown::bounds_within`]).
    #[must_use]
    pub fn within(unknowns: &[Unknown], origin: &Point, scenes: &[Bounds]) -> Self {
        let bounds: Vec<(f64, f64)> = unknowns.iter().map(|u| u.bounds_within(scenes)).collect();
        let bounded = || unknowns.iter().zip(&bounds);
        Self {
            unknowns: unknowns.to_vec(),
            origin: origin.clone(),
            at_origin: unknowns.iter().map(|u| inward(u, u.get(origin))).collect(),
            lower: bounded().map(|(u, (lower, _))| inward(u, *lower)).collect(),
            upper: bounded().map(|(u, (_, upper))| inward(u, *upper)).collect(),
            bounds,
        }
    }

    /// Least and greatest value of each unknown.
    #[must_use]
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// The unknowns, in order.
    #[must_use]
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// The coordinates of the origin.
    #[must_use]
    pub fn origin(&self) -> &[f64] {
        &self.at_origin
    }

    /// Least allowed coordinates.
    #[must_use]
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Greatest allowed coordinates.
    #[must_use]
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// The point at these coordinates. Bounds and the origin come back to the bit.
    #[must_use]
    pub fn point(&self, at: &[f64]) -> Point {
        let mut point = self.origin.clone();
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let (low, high) = self.bounds[i];
            if at[i] <= self.lower[i] {
                unknown.set(&mut point, low);
            } else if at[i] >= self.upper[i] {
                unknown.set(&mut point, high);
            } else if at[i] != self.at_origin[i] {
                unknown.set(&mut point, outward(unknown, at[i]).clamp(low, high));
            }
        }
        point
    }

    /// `at + step`, within the bounds, and on a bound to the bit where the step reaches it.
    #[must_use]
    pub fn moved(&self, at: &[f64], step: &[f64]) -> Vec<f64> {
        (0..at.len())
            .map(|i| match step[i] {
                d if d <= self.lower[i] - at[i] => self.lower[i],
                d if d >= self.upper[i] - at[i] => self.upper[i],
                d => at[i] + d,
            })
            .collect()
    }

    /// How far a step from `at` may go down and up.
    #[must_use]
    pub fn room(&self, at: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let to = |bounds: &[f64]| bounds.iter().zip(at).map(|(b, u)| b - u).collect();
        (to(&self.lower), to(&self.upper))
    }

    /// The derivative of unknown `i`'s value with respect to its coordinate.
    #[must_use]
    pub fn slope(&self, i: usize, at: f64) -> f64 {
        if is_log(&self.unknowns[i]) { outward(&self.unknowns[i], at) } else { 1.0 }
    }

    /// The size that a change of coordinate `i` is compared with: the coordinate's own, but no less
    /// than what is natural (a hundredth of a weight, one unit of a logarithm, one degree).
    #[must_use]
    pub fn size(&self, i: usize, at: f64) -> f64 {
        match self.unknowns[i] {
            u if is_log(&u) => 1.0,
            u if is_angle(&u) => at.abs().max(1.0),
            _ => at.abs().max(0.01),
        }
    }
}

/// Whether a solver steps through this unknown by its logarithm.
#[must_use]
pub fn is_log(unknown: &Unknown) -> bool {
    unknown.column().is_some_and(|column| column.param.info().scale == Scale::Log)
}

/// Whether it is an angle.
pub(super) fn is_angle(unknown: &Unknown) -> bool {
    unknown.column().is_some_and(|column| column.param.info().unit == "degrees")
}

fn inward(unknown: &Unknown, value: f64) -> f64 {
    if is_log(unknown) { value.ln() } else { value }
}

fn outward(unknown: &Unknown, at: f64) -> f64 {
    if is_log(unknown) { at.exp() } else { at }
}
