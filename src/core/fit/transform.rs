//! Bounds for solvers that know none: each coordinate as a smooth function of a free variable, and shares of a whole lowered
//! together where they would add up to more.

use super::coordinates::Coordinates;
use super::linearisation::Linearisation;

/// Free variables beyond this would overflow a 32-bit image squared: `exp(30)` is 10^13.
const MOST: f64 = 30.0;
/// A start on a bound is taken this share of the interval (or of 1) inside: on the bound itself
/// the transform has no slope, and a solver would never leave it.
const NUDGE: f64 = 0.05;
/// Starts this near to a bound, as a share of the interval (or of 1), count as on it.
const NEAR: f64 = 1e-3;

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// No bounds: itself.
    Free,
    /// `bound + sign * exp(y)`
    Half { bound: f64, sign: f64 },
    /// `lower + width / (1 + exp(-y))`
    Logistic { lower: f64, width: f64 },
}

/// The map from free variables to bounded coordinates, in units that make the loss about equally
/// sensitive to each variable.
#[derive(Clone, Debug)]
pub struct Transform {
    shapes: Vec<Shape>,
    unit: Vec<f64>,
    start: Vec<f64>,
    /// Who knows what shares of a whole may add up to: beyond it they are lowered alike.
    within: Coordinates,
}

impl Transform {
    /// The transform of these coordinates with units from the curvatures at `first`.
    #[must_use]
    pub fn new(coordinates: &Coordinates, first: &Linearisation) -> Self {
        let k = first.len();
        let shapes: Vec<Shape> =
            (0..k).map(|i| Shape::within(coordinates.lower()[i], coordinates.upper()[i])).collect();
        let raw: Vec<f64> = (0..k).map(|i| shapes[i].inverse(first.at[i])).collect();
        let unit: Vec<f64> = (0..k)
            .map(|i| {
                let sensitivity = (first.curvature(i) / first.weight).sqrt() * shapes[i].slope(raw[i]);
                if sensitivity > 0.0 && sensitivity.is_finite() { 1.0 / sensitivity } else { 1.0 }
            })
            .collect();
        let start = raw.iter().zip(&unit).map(|(y, u)| y / u).collect();
        Self { shapes, unit, start, within: coordinates.clone() }
    }

    /// The free variables where the solver starts.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// The coordinates at free variables `y`.
    #[must_use]
    pub fn coordinates(&self, y: &[f64]) -> Vec<f64> {
        let mut at = self.in_intervals(y);
        self.within.share_out(&mut at);
        at
    }

    /// The gradient with respect to the free variables, from that with respect to coordinates.
    #[must_use]
    pub fn pull_back(&self, y: &[f64], gradient: &[f64]) -> Vec<f64> {
        let mut gradient = gradient.to_vec();
        self.within.share_out_pulled_back(&self.in_intervals(y), &mut gradient);
        (0..y.len()).map(|i| gradient[i] * self.shapes[i].slope(y[i] * self.unit[i]) * self.unit[i]).collect()
    }

    fn in_intervals(&self, y: &[f64]) -> Vec<f64> {
        self.shapes.iter().zip(y).zip(&self.unit).map(|((shape, y), unit)| shape.value(y * unit)).collect()
    }

    /// The corners of a first simplex: the start, and a step along each variable by which the image
    /// changes as much as it misses the target (`rms`), or by a fifth of the variable if that is less.
    #[must_use]
    pub fn simplex(&self, rms: f64) -> Vec<Vec<f64>> {
        let corner = |i: usize| {
            let mut corner = self.start.clone();
            let natural = 0.2 * (self.start[i] * self.unit[i]).abs().max(1.0) / self.unit[i];
            corner[i] += if rms > 0.0 { rms.min(natural) } else { natural };
            corner
        };
        std::iter::once(self.start.clone()).chain((0..self.start.len()).map(corner)).collect()
    }
}

impl Shape {
    fn within(lower: f64, upper: f64) -> Self {
        match (lower.is_finite(), upper.is_finite()) {
            (true, true) => Self::Logistic { lower, width: upper - lower },
            (true, false) => Self::Half { bound: lower, sign: 1.0 },
            (false, true) => Self::Half { bound: upper, sign: -1.0 },
            (false, false) => Self::Free,
        }
    }

    fn value(self, y: f64) -> f64 {
        match self {
            Self::Free => y,
            Self::Half { bound, sign } => bound + sign * y.min(MOST).exp(),
            Self::Logistic { lower, width } => lower + width / (1.0 + (-y).exp()),
        }
    }

    fn slope(self, y: f64) -> f64 {
        match self {
            Self::Free => 1.0,
            Self::Half { .. } if y > MOST => 0.0,
            Self::Half { sign, .. } => sign * y.exp(),
            // The same from both sides, and no overflow.
            Self::Logistic { width, .. } => width * (-y.abs()).exp() / (1.0 + (-y.abs()).exp()).powi(2),
        }
    }

    fn inverse(self, at: f64) -> f64 {
        match self {
            Self::Free => at,
            Self::Half { bound, sign } => match sign * (at - bound) {
                inside if inside < NEAR => NUDGE.ln(),
                inside => inside.ln(),
            },
            Self::Logistic { lower, width } => {
                // A gain's interval is a thousand wide, and 1 is in the midst of it: there 1 is what counts.
                let reach = width.min(1.0);
                let above = match at - lower {
                    above if above < NEAR * reach => NUDGE * reach,
                    above if width - above < NEAR * reach => width - NUDGE * reach,
                    above => above,
                };
                (above / (width - above)).ln()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Unknown;
    use crate::model::params::Channels;

    #[test]
    fn values_stay_within_bounds_and_slopes_are_their_derivatives() {
        for (lower, upper) in [(-1.0, 3.0), (0.0, f64::INFINITY), (f64::NEG_INFINITY, 2.0)] {
            let shape = Shape::within(lower, upper);
            for y in [-1e4, -20.0, -1.0, 0.0, 0.3, 5.0, 1e4_f64] {
                assert!((lower..=upper).contains(&shape.value(y)));
                let h = 1e-6 * y.abs().max(1.0);
                let difference = (shape.value(y + h) - shape.value(y - h)) / (2.0 * h);
                // Central differences: h^2 of truncation plus 1e-16/h of rounding, of values up to 150.
                assert!((shape.slope(y) - difference).abs() < 1e-7 * shape.value(y).abs().max(1.0), "{y}");
            }
            for inside in [0.5, 1.0, 1.5] {
                // exp(ln x), ln and two additions: a few roundings.
                assert!((shape.value(shape.inverse(inside)) - inside).abs() < 1e-14);
            }
        }
        // A gain starts where it is, not at a share of its interval, which is a thousand wide.
        let gain = Unknown::Gain(1, Channels::Tied).bounds();
        let gain = Shape::within(gain.0, gain.1);
        for inside in [0.01, 0.5, 1.0, 1.3, 50.0] {
            // The width, by which ratios are rounded, is a thousand times 1.
            assert!((gain.value(gain.inverse(inside)) - inside).abs() < 1e-12, "{inside}");
        }
        // A start on a bound is nudged off it.
        let half = Shape::within(0.0, f64::INFINITY);
        assert!((half.value(half.inverse(0.0)) - NUDGE).abs() < 1e-15);
        let nudged = Shape::within(0.0, 1.0);
        assert!((nudged.value(nudged.inverse(1.0)) - (1.0 - NUDGE)).abs() < 1e-14);
    }
}
