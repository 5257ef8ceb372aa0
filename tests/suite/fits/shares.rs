//! Parameters that are shares of a whole: fits by every solver within that whole.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use skinfit::engine::{NormalEquations, Objective, Point, Unknown};
use skinfit::fit::outcome::Outcome;
use skinfit::fit::{FitOptions, SolverKind, fit};
use skinfit::model::effects::Form;
use skinfit::model::gain::Gain;
use skinfit::model::params::{Channels, Column, Param, Params};
use skinfit::shader::term::library;

/// Pixels of light before three blurs and after each, exposed: `gain (light_0 + sum of weight (light_k - light_0))`.
struct Blurred {
    unknowns: Vec<Unknown>,
    pixels: Vec<[[f64; 3]; 4]>,
    target: Vec<[f64; 3]>,
}

fn weights() -> [Param; 3] {
    library::register_all();
    [1, 2, 3].map(|k| Param::from_name(&format!("diffusion_weight_{k}")).unwrap())
}

/// Weights in red, green and blue.
fn point(of: [[f64; 3]; 3]) -> Point {
    let mut params = Params::defaults(Form::Corrected);
    weights().into_iter().zip(of).for_each(|(param, rgb)| params.set_rgb(param, rgb));
    Point { params, gains: vec![Gain::ONE] }
}

impl Blurred {
    /// Under the light of weights that need not be possible.
    fn new(truth: [[f64; 3]; 3]) -> Self {
        let mut rng = StdRng::seed_from_u64(17);
        let mut light = || [0; 4].map(|_| [0; 3].map(|_| rng.random_range(0.2..1.0_f64)));
        let pixels: Vec<_> = (0..200).map(|_| light()).collect();
        let each = weights().into_iter().flat_map(Column::per_channel).map(Unknown::Param);
        let unknowns = each.chain([Unknown::Gain(0, Channels::Tied)]).collect();
        let mut blurred = Self { unknowns, pixels, target: Vec::new() };
        blurred.target = (0..200).map(|i| [0, 1, 2].map(|c| blurred.value(&point(truth), i, c))).collect();
        blurred
    }

    fn value(&self, point: &Point, pixel: usize, c: usize) -> f64 {
        let light = &self.pixels[pixel];
        let blurs = weights().into_iter().zip(&light[1..]);
        let more: f64 =
            blurs.map(|(weight, level)| point.params.rgb(weight)[c] * (level[c] - light[0][c])).sum();
        point.gains[0].channel(c) * (light[0][c] + more)
    }

    fn slope(&self, point: &Point, unknown: &Unknown, pixel: usize, c: usize) -> f64 {
        let gain = point.gains[0].channel(c);
        let Some(column) = unknown.column() else { return self.value(point, pixel, c) / gain };
        let level = 1 + weights().iter().position(|weight| *weight == column.param).unwrap();
        let light = &self.pixels[pixel];
        if column.channels.includes(c) { gain * (light[level][c] - light[0][c]) } else { 0.0 }
    }
}

impl Objective for Blurred {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }
    fn is_quadratic(&self) -> bool {
        true
    }
    fn normal_equations(&self, point: &Point) -> NormalEquations {
        let k = self.unknowns.len();
        let (mut residual, mut jtr, mut jtj) = (0.0, vec![0.0; k], vec![0.0; k * k]);
        for (pixel, target) in self.target.iter().enumerate() {
            for c in 0..3 {
                let r = self.value(point, pixel, c) - target[c];
                let row: Vec<f64> = self.unknowns.iter().map(|u| self.slope(point, u, pixel, c)).collect();
                residual += r * r;
                for i in 0..k {
                    jtr[i] += row[i] * r;
                    (0..k).for_each(|j| jtj[i * k + j] += row[i] * row[j]);
                }
            }
        }
        let count = 3 * self.target.len() as u64;
        let weight = count as f64;
        NormalEquations { loss: residual / weight, residual, weight, count, jtr, jtj }
    }
    fn loss(&self, point: &Point) -> f64 {
        self.normal_equations(point).loss
    }
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        self.normal_equations(point).loss_and_gradient()
    }
}

fn fitted(image: &Blurred, start: &Point, solver: SolverKind) -> Outcome {
    fit(image, start, &FitOptions { solver, ..FitOptions::default() }, &mut |_| {}).unwrap()
}

fn total(point: &Point, c: usize) -> f64 {
    weights().iter().map(|weight| point.params.rgb(*weight)[c]).sum()
}

/// Red wants more than there is; green and blue do not.
const TRUTH: [[f64; 3]; 3] = [[0.5, 0.2, 0.1], [0.4, 0.3, 0.0], [0.3, 0.1, 0.5]];

#[test]
fn every_solver_ends_within_the_whole_and_those_of_the_steps_at_the_best_of_it() {
    let image = Blurred::new(TRUTH);
    let start = point([[0.2; 3]; 3]);
    let best = fitted(&image, &start, SolverKind::Varpro);
    for solver in SolverKind::ALL {
        let outcome = fitted(&image, &start, solver);
        for c in 0..3 {
            // Of sums of three numbers.
            assert!(total(&outcome.end, c) <= 1.0 + 1e-12, "{solver:?}: {}", total(&outcome.end, c));
        }
        // What the end is said to be is what it is.
        let measured = image.loss(&outcome.end) / outcome.loss_end;
        assert!((measured - 1.0).abs() < 1e-9, "{solver:?}: {measured}");
        // The others end where their steps promise less than a thousandth of the loss.
        let near = if matches!(solver, SolverKind::Varpro | SolverKind::Lm) { 1e-6 } else { 1e-2 };
        let ratio = outcome.loss_end / best.loss_end;
        println!("{solver:?}: {ratio}, {} passes", outcome.evaluations);
        assert!((ratio - 1.0).abs() < near, "{solver:?}: {ratio}");
    }
    assert!((total(&best.end, 0) - 1.0).abs() < 1e-12, "{}", total(&best.end, 0));
    let red = ["diffusion_weight_1.r", "diffusion_weight_2.r", "diffusion_weight_3.r"];
    assert_eq!(best.full_shares, [red]);
    // No point within the whole has a lower loss: of 500 near the best, brought back within it.
    let mut rng = StdRng::seed_from_u64(4);
    for _ in 0..500 {
        let mut other = best.end.clone();
        for weight in weights() {
            let moved = best.end.params.rgb(weight).map(|x| (x + rng.random_range(-0.02..0.02_f64)).max(0.0));
            other.params.set_rgb(weight, moved);
        }
        let gain = rng.random_range(0.99..1.01);
        other.gains[0] = Gain(best.end.gains[0].0.map(|x| x * gain));
        for c in 0..3 {
            let most = total(&other, c).max(1.0);
            for weight in weights() {
                let mut rgb = other.params.rgb(weight);
                rgb[c] /= most;
                other.params.set_rgb(weight, rgb);
            }
        }
        assert!(image.loss(&other) >= best.loss_end * (1.0 - 1e-9));
    }
}

#[test]
fn errors_are_of_steps_that_keep_the_whole() {
    let image = Blurred::new(TRUTH);
    let outcome = fitted(&image, &point([[0.2; 3]; 3]), SolverKind::Varpro);
    let error = |name: &str| outcome.constant(name).unwrap().std_error.unwrap();
    let k = outcome.unknowns.len();
    let place = |name: &str| outcome.unknowns.iter().position(|u| u.unknown.name() == name).unwrap();
    let covariance = |a: &str, b: &str| error(a) * error(b) * outcome.correlations[place(a) * k + place(b)];
    let variance = |channel: &str| {
        let names = [1, 2, 3].map(|level| format!("diffusion_weight_{level}.{channel}"));
        names.iter().flat_map(|a| names.iter().map(move |b| covariance(a, b))).sum::<f64>()
    };
    let one = error("diffusion_weight_1.r").powi(2);
    // The sum is known where it is full: cancellation of nine numbers of that size is left.
    assert!(variance("r").abs() < 1e-10 * one, "{} {one}", variance("r"));
    assert!(variance("g") > 1e-3 * error("diffusion_weight_1.g").powi(2));
}

#[test]
fn what_is_held_leaves_less_and_a_start_beyond_the_whole_keeps_what_it_has() {
    let mut image = Blurred::new(TRUTH);
    image.unknowns.retain(|u| u.column().is_none_or(|column| column.param != weights()[2]));
    let outcome = fitted(&image, &point([[0.2; 3], [0.2; 3], [0.6, 0.1, 0.5]]), SolverKind::Varpro);
    assert!((total(&outcome.end, 0) - 1.0).abs() < 1e-12, "{}", total(&outcome.end, 0));
    // Less than what red wants, 1.2, and more than there is.
    let beyond = point([[0.4; 3], [0.55; 3], [0.1; 3]]);
    let outcome = fitted(&image, &beyond, SolverKind::Varpro);
    let totals = [0, 1, 2].map(|c| total(&outcome.end, c));
    assert!(totals.iter().all(|total| *total <= 1.05 + 1e-12), "{totals:?}");
    assert!((totals[0] - 1.05).abs() < 1e-12, "{totals:?}");
    // Of one that is free alone, what the others leave is its bound.
    image.unknowns = Column::per_channel(weights()[0]).map(Unknown::Param).to_vec();
    let outcome = fitted(&image, &point([[0.1; 3], [0.4, 0.3, 0.0], [0.3, 0.1, 0.5]]), SolverKind::Varpro);
    let red = outcome.constant("diffusion_weight_1.r").unwrap();
    assert!((red.value - 0.3).abs() < 1e-12 && red.at_bound && red.std_error.is_none(), "{red:?}");
    assert!(outcome.full_shares.is_empty());
}

#[test]
fn channels_that_are_tied_keep_the_whole_of_each() {
    let mut image = Blurred::new(TRUTH);
    image.unknowns = weights().map(|weight| Unknown::Param(Column::tied(weight))).to_vec();
    image.unknowns[2] = Unknown::Param(Column { param: weights()[2], channels: Channels::One(0) });
    let start = point([[0.1; 3], [0.1; 3], [0.2, 0.7, 0.1]]);
    let best = fitted(&image, &start, SolverKind::Varpro).loss_end;
    for solver in [SolverKind::Varpro, SolverKind::Lm, SolverKind::Lbfgs] {
        let outcome = fitted(&image, &start, solver);
        // Green holds 0.7 already, of which the two that are tied want more than it leaves.
        let totals = [0, 1, 2].map(|c| total(&outcome.end, c));
        assert!(totals.iter().all(|total| *total <= 1.0 + 1e-12), "{solver:?}: {totals:?}");
        assert!(totals[1] > 0.99, "{solver:?}: {totals:?}");
        // As above.
        let near = if solver == SolverKind::Lbfgs { 1e-2 } else { 1e-6 };
        assert!((outcome.loss_end / best - 1.0).abs() < near, "{solver:?}: {} {best}", outcome.loss_end);
    }
}

#[test]
fn starts_are_drawn_within_the_whole() {
    let image = Blurred::new(TRUTH);
    let options = FitOptions { starts: 6, max_iterations: Some(1), ..FitOptions::default() };
    let outcome = fit(&image, &point([[0.2; 3]; 3]), &options, &mut |_| {}).unwrap();
    assert!((0..3).all(|c| total(&outcome.end, c) <= 1.0 + 1e-12));
}
