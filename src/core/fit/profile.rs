//! The profile of the weakest unknown: how the loss rises beside the answer when one unknown is held and the others are
//! solved for anew.
//!
//! A standard error says how the loss rises by its curvature at the answer. Along a curved valley it rises less, and two
//! solvers that both stop in it may disagree by many standard errors. The profile walks along the valley (Bates and Watts
//! 1988, *Nonlinear Regression Analysis and Its Applications*, chapter 6; Venzon and Moolgavkar 1988, Applied Statistics
//! 37): its interval is where the loss rises by no more than the curvature says of one standard error.

use super::bounded;
use super::coordinates::{Coordinates, is_angle, is_log};
use super::linearisation::{Linearisation, Passes};

/// An unknown whose standard error is a smaller share of its size needs no profile: over it a valley is straight.
const WEAK: f64 = 0.1;
/// Standard errors from the answer at which the unknown is held, one after the other, until the loss has risen enough.
const STEPS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// Most passes that solve for the others at one of them.
const MOST_PASSES: u32 = 6;
/// The others are solved for when what a step promises is this share of the rise that is looked for.
const SETTLED: f64 = 0.01;
/// An interval that is wider than its standard error says by this factor is a valley.
const WIDE: f64 = 1.5;

/// One place of a profile.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ProfilePoint {
    /// The unknown's value.
    pub value: f64,
    /// The loss there, the others at their best.
    pub loss: f64,
}

/// What the profile of one unknown shows.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Profile {
    /// Which unknown, by its name.
    pub name: String,
    /// Its value at the answer.
    pub value: f64,
    /// Its standard error there.
    pub std_error: f64,
    /// The rise of the loss that its standard error stands for.
    pub rise: f64,
    /// Where the loss has risen by that; an end that was not found is where the search ended (a bound, or 16 errors away).
    pub interval: [f64; 2],
    /// Whether each end was found, and is not merely where the search ended.
    pub closed: [bool; 2],
    /// What was looked at, by value; the answer among them.
    pub points: Vec<ProfilePoint>,
    /// Passes over the samples that it took.
    pub passes: u64,
}

impl Profile {
    /// Whether the interval is far wider than the standard error says.
    #[must_use]
    pub fn is_valley(&self) -> bool {
        let wide = |end: usize| {
            let sign = if end == 0 { -1.0 } else { 1.0 };
            sign * (self.interval[end] - self.value) > WIDE * self.std_error
        };
        wide(0) || wide(1) || self.lower().is_some()
    }

    /// A place where the loss is lower than at the answer by more than the rise that is looked for.
    #[must_use]
    pub fn lower(&self) -> Option<ProfilePoint> {
        let answer = self.points.iter().find(|point| point.value == self.value)?;
        let least = self.points.iter().min_by(|a, b| a.loss.total_cmp(&b.loss))?;
        (least.loss < answer.loss - self.rise).then_some(*least)
    }
}

/// What is known of an answer, in coordinates.
pub(super) struct Answer<'a> {
    /// The pass there.
    pub(super) model: &'a Linearisation,
    /// A standard error for each unknown that has one, in coordinates.
    pub(super) errors: &'a [Option<f64>],
    /// The variance of each unknown where residuals are of unit variance: the diagonal of (J'WJ)^+.
    pub(super) unit: &'a [f64],
}

/// The non-linear unknown with the greatest error beside its size, where it is a weak one. An angle's size is a radian.
pub(super) fn weakest(coordinates: &Coordinates, answer: &Answer<'_>) -> Option<usize> {
    let share = |i: usize| {
        let unknown = &coordinates.unknowns()[i];
        let error = answer.errors[i].filter(|_| !unknown.linear())?;
        let size = if is_log(unknown) {
            1.0
        } else if is_angle(unknown) {
            1.0_f64.to_degrees()
        } else {
            answer.model.at[i].abs().max(coordinates.size(i, answer.model.at[i]))
        };
        Some((i, error / size))
    };
    let shares = (0..answer.model.len()).filter_map(share).filter(|(_, share)| *share >= WEAK);
    shares.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// The profile of unknown `i`; `stop` ends it early, with the points found by then. `None` where a pass fails.
pub(super) fn profile(
    passes: &Passes<'_>,
    answer: &Answer<'_>,
    i: usize,
    stop: &dyn Fn() -> bool,
) -> Option<Profile> {
    let (coordinates, model) = (passes.coordinates(), answer.model);
    let error = answer.errors[i].filter(|e| *e > 0.0)?;
    // Along the valley the quadratic of the sum of squares rises by d^2 / (J'WJ)^+_ii over a step d.
    let rise = error * error / (answer.unit[i].max(f64::MIN_POSITIVE) * model.weight);
    let before = passes.count();
    let valued = |at: &[f64]| coordinates.unknowns()[i].get(&coordinates.point(at));
    let mut points = vec![ProfilePoint { value: valued(&model.at), loss: model.loss }];
    let (mut interval, mut closed) = ([0.0; 2], [false; 2]);
    for (end, sign) in [(0, -1.0), (1, 1.0)] {
        let mut walk = vec![(model.at[i], 0.0)];
        let mut base = model.clone();
        for step in STEPS {
            let to =
                (model.at[i] + sign * step * error).clamp(coordinates.lower()[i], coordinates.upper()[i]);
            if to == base.at[i] || stop() {
                break;
            }
            base = held(passes, &base, i, to, SETTLED * rise)?;
            walk.push((to, base.loss - model.loss));
            points.push(ProfilePoint { value: valued(&base.at), loss: base.loss });
            if base.loss - model.loss >= rise {
                closed[end] = true;
                break;
            }
        }
        let mut at = model.at.clone();
        at[i] = crossing(&walk, rise);
        interval[end] = valued(&at);
    }
    passes.check().ok()?;
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
    let (name, value) = (coordinates.unknowns()[i].name(), valued(&model.at));
    let std_error = error * coordinates.slope(i, model.at[i]);
    let passes = passes.count() - before;
    Some(Profile { name, value, std_error, rise, interval, closed, points, passes })
}

/// Where the rise is reached, between the last two places of a walk: the root of the rise is nearly straight. The last one
/// where it is not.
fn crossing(walk: &[(f64, f64)], rise: f64) -> f64 {
    let root = |x: f64| x.max(0.0).sqrt();
    match walk {
        [.., (from, low), (to, high)] if *high >= rise => {
            let share = (root(rise) - root(*low)) / (root(*high) - root(*low)).max(f64::MIN_POSITIVE);
            from + share.clamp(0.0, 1.0) * (to - from)
        }
        [.., (last, _)] => *last,
        [] => f64::NAN,
    }
}

/// The others' best with unknown `i` held at coordinate `to`, from `base`: bounded Gauss-Newton steps, damped where one
/// raises the loss. `None` where nothing finite is found.
fn held(passes: &Passes<'_>, base: &Linearisation, i: usize, to: f64, enough: f64) -> Option<Linearisation> {
    let coordinates = passes.coordinates();
    let k = base.len();
    // What the base's quadratic says of the others beside the step of this one.
    let along: Vec<f64> = (0..k).map(|j| if j == i { to - base.at[i] } else { 0.0 }).collect();
    let step = others(coordinates, &base.moved(&along, base.at.clone()), i, 0.0);
    let mut at = coordinates.moved(&base.at, &step);
    at[i] = to;
    let mut best = passes.linearise(&at);
    if !best.is_finite() {
        // Then the others as they were.
        let mut plain = base.at.clone();
        plain[i] = to;
        best = passes.linearise(&plain);
    }
    let mut damping = 0.0;
    for _ in 1..MOST_PASSES {
        let step = others(coordinates, &best, i, damping);
        if -best.change(&step) <= enough {
            break;
        }
        let trial = passes.linearise(&coordinates.moved(&best.at, &step));
        if trial.is_finite() && trial.loss < best.loss {
            best = trial;
            damping *= 0.1;
        } else {
            damping = (10.0 * damping).max(1e-2);
        }
    }
    best.is_finite().then_some(best)
}

/// The bounded step of all unknowns but `i`.
fn others(coordinates: &Coordinates, model: &Linearisation, i: usize, damping: f64) -> Vec<f64> {
    let k = model.len();
    let mut hessian = model.hessian.clone();
    (0..k).for_each(|j| hessian[j * k + j] *= 1.0 + damping);
    let mut room = coordinates.room(&model.at);
    room.hold(i);
    bounded::minimise(&hessian, &model.gradient, &room)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{NormalEquations, Objective, Point, Unknown};
    use crate::model::effects::Form;
    use crate::model::params::{Column, Param, Params};

    /// Rows of a small problem in an exponent x and a weight y: value and slopes by both.
    type Row = fn(f64, f64) -> [f64; 3];

    /// Least squares in the rim's exponent and its weight.
    struct Two {
        unknowns: Vec<Unknown>,
        rows: Vec<(Row, f64)>,
    }

    fn two(rows: &[(Row, f64)]) -> Two {
        let of = |param| Unknown::Param(Column::tied(param));
        Two { unknowns: vec![of(Param::EnvironmentRotation), of(Param::Hilite)], rows: rows.to_vec() }
    }

    fn at(x: f64, y: f64) -> Point {
        let mut params = Params::defaults(Form::Corrected);
        params.set(Param::EnvironmentRotation, x);
        params.set(Param::Hilite, y);
        Point { params, gains: vec![] }
    }

    impl Objective for Two {
        fn unknowns(&self) -> &[Unknown] {
            &self.unknowns
        }
        fn normal_equations(&self, point: &Point) -> NormalEquations {
            let [x, y] = [0, 1].map(|i| self.unknowns[i].get(point));
            let n = self.rows.len() as f64;
            let (mut jtr, mut jtj, mut squares) = (vec![0.0; 2], vec![0.0; 4], 0.0);
            for (row, target) in &self.rows {
                let [value, slopes @ ..] = row(x, y);
                let r = value - target;
                squares += r * r;
                for a in 0..2 {
                    jtr[a] += slopes[a] * r;
                    (0..2).for_each(|b| jtj[2 * a + b] += slopes[a] * slopes[b]);
                }
            }
            let count = self.rows.len() as u64;
            NormalEquations { loss: squares / n, residual: squares, weight: n, count, jtr, jtj }
        }
        fn loss(&self, point: &Point) -> f64 {
            self.normal_equations(point).loss
        }
        fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
            self.normal_equations(point).loss_and_gradient()
        }
    }

    /// The profile of the angle at an answer where residuals have the deviation `s`.
    fn of(problem: &Two, answer: &Point, s: f64) -> Profile {
        let coordinates = Coordinates::new(&problem.unknowns, answer);
        let passes = Passes::new(problem, &coordinates, 0);
        let model = passes.linearise(coordinates.origin());
        let h = &model.hessian;
        let unit = h[3] / (h[0] * h[3] - h[1] * h[2]);
        let errors = [Some(s * unit.sqrt()), None];
        let known = Answer { model: &model, errors: &errors, unit: &[unit, 0.0] };
        profile(&passes, &known, 0, &|| false).unwrap()
    }

    #[test]
    fn of_a_straight_valley_the_interval_is_one_standard_error() {
        let rows: [(Row, f64); 3] = [
            (|x, y| [0.1 * x + y, 0.1, 1.0], 2.0),
            (|x, y| [0.1 * x - y, 0.1, -1.0], 0.0),
            (|x, y| [0.02 * x + y, 0.02, 1.0], 1.2),
        ];
        let profile = of(&two(&rows), &at(10.0, 1.0), 0.01);
        for end in 0..2 {
            // The crossing is exact of a quadratic, to what the others are not solved for: a hundredth of the rise.
            let off = (profile.interval[end] - profile.value).abs() / profile.std_error;
            assert!((off - 1.0).abs() < 0.01 && profile.closed[end], "{profile:?}");
        }
        assert!(!profile.is_valley() && profile.lower().is_none());
        // One pass a place, and one that confirms: the first step already finds the others.
        assert!(profile.passes <= 4, "{}", profile.passes);
    }

    #[test]
    fn a_bent_valley_shows_as_a_wide_interval() {
        // (y - 1) follows a parabola of x: along it only a faint term tells x, and it fades away from the answer.
        let rows: [(Row, f64); 2] = [
            (|x, y| [y - 0.01 * x * x, -0.02 * x, 1.0], 0.0),
            (|x, _| [1e-3 * (0.3 * x).tanh(), 3e-4 / (0.3 * x).cosh().powi(2), 0.0], 1e-3 * 1.5_f64.tanh()),
        ];
        let profile = of(&two(&rows), &at(5.0, 0.25), 1e-4);
        // tanh rises from 0.905 to 1 at most: no x above the answer is told apart.
        assert!(!profile.closed[1] && profile.is_valley(), "{profile:?}");
        assert!(profile.interval[1] > profile.value + 8.0 * profile.std_error, "{profile:?}");
        // Below, tanh is 1e-4 over 1e-3 lower at 0.805, that is at x = 3.71; the root's line over 1.8 misses its bend
        // by 0.2.
        assert!(profile.closed[0] && (profile.interval[0] - 3.71).abs() < 0.25, "{profile:?}");
    }

    #[test]
    fn a_lower_place_along_the_valley_is_named() {
        let profile = |losses: [f64; 3]| {
            let point = |(i, loss)| ProfilePoint { value: i as f64, loss };
            Profile {
                name: "specular_lobe".to_owned(),
                value: 0.0,
                std_error: 1.0,
                rise: 0.1,
                interval: [0.0, 1.2],
                closed: [false, true],
                points: losses.into_iter().enumerate().map(point).collect(),
                passes: 0,
            }
        };
        assert_eq!(profile([1.0, 0.8, 0.9]).lower(), Some(ProfilePoint { value: 1.0, loss: 0.8 }));
        assert!(profile([1.0, 0.8, 0.9]).is_valley());
        // Lower by less than the rise is nothing.
        assert_eq!(profile([1.0, 0.95, 1.2]).lower(), None);
        assert!(!profile([1.0, 0.95, 1.2]).is_valley());
    }

    #[test]
    fn the_weakest_is_the_one_of_the_greatest_share_and_an_angle_is_measured_in_radians() {
        let of = |param| Unknown::Param(Column::tied(param));
        let unknowns = [
            of(Param::EnvironmentRotation),
            of(Param::SpecularLobe),
            of(Param::Hilite),
            of(Param::Occlusion),
        ];
        let point = Point { params: Params::defaults(Form::Corrected), gains: vec![] };
        let coordinates = Coordinates::new(&unknowns, &point);
        let model = Linearisation {
            at: coordinates.origin().to_vec(),
            loss: 1.0,
            residual: 1.0,
            weight: 1.0,
            count: 1,
            gradient: vec![0.0; 4],
            hessian: vec![0.0; 16],
        };
        let weakest = |errors: &[Option<f64>]| {
            weakest(&coordinates, &Answer { model: &model, errors, unit: &[0.0; 4] })
        };
        // Five degrees are a twelfth of a radian; linear ones are not asked.
        assert_eq!(weakest(&[Some(5.0), Some(0.09), Some(1e3), Some(0.01)]), None);
        assert_eq!(weakest(&[Some(6.0), Some(0.3), Some(1e3), Some(0.01)]), Some(1));
        assert_eq!(weakest(&[Some(40.0), Some(0.3), None, None]), Some(0));
        assert_eq!(weakest(&[None; 4]), None);
    }
}
