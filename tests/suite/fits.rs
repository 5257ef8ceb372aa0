//! The solvers on a small image of the skin model's structure, whose truth is known.

#![allow(clippy::unwrap_used, reason = "what fails in a test's helper fails the test")]

mod bounded;
mod correlated;
mod damaged;
mod image;
mod resumed;
mod rough;
mod shares;
mod uncertain;

use image::{Image, nine, point, tied, truth};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use skinfit::engine::{Objective, Point, Unknown};
use skinfit::fit::outcome::{Ending, Outcome};
use skinfit::fit::{FitOptions, SolverKind, Tolerances, fit};
use skinfit::model::params::{Channels, Column, Param};
use skinfit::scene::Loss;

/// Fit with the defaults.
fn run(objective: &dyn Objective, start: &Point, solver: SolverKind) -> Outcome {
    fit(objective, start, &FitOptions { solver, ..FitOptions::default() }, &mut |_| {}).unwrap()
}

/// The largest relative error of an unknown.
fn error(outcome: &Outcome, truth: &Point) -> f64 {
    let errors = outcome.unknowns.iter().map(|u| {
        let true_value = u.unknown.get(truth);
        (u.value - true_value).abs() / true_value.abs()
    });
    errors.fold(0.0, f64::max)
}

/// The defaults, all weights off, and two starts from which the non-linear unknowns are far off.
fn starts() -> [Point; 4] {
    use Param as P;
    [
        point(&[]),
        point(&[(P::BaseWeight, 0.0), (P::RimWeight, 0.0), (P::Hilite, 0.0), (P::Occlusion, 0.0)]),
        point(&[(P::RimExponent, 8.0), (P::SpecularLobe, 400.0), (P::EnvironmentRotation, -20.0)]),
        point(&[(P::RimExponent, 0.5), (P::SpecularLobe, 5.0), (P::EnvironmentRotation, 40.0)]),
    ]
}

fn random_start(seed: u64) -> Point {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut within = |low: f64, high: f64| rng.random_range(low..high);
    point(&[
        (Param::BaseWeight, within(0.0, 2.0)),
        (Param::RimWeight, within(-1.0, 3.0)),
        (Param::RimExponent, within(-1.3, 2.7).exp()),
        (Param::Hilite, within(0.0, 2.0)),
        (Param::Reflection, within(0.0, 0.5)),
        (Param::SideSpecular, within(0.0, 2.0)),
        (Param::Occlusion, within(0.0, 1.0)),
        (Param::SpecularLobe, within(0.5, 7.0).exp()),
        (Param::EnvironmentRotation, within(-60.0, 60.0)),
    ])
}

#[test]
fn without_noise_all_nine_come_back_from_any_start_in_a_few_passes() {
    for solver in [SolverKind::Varpro, SolverKind::Lm] {
        for (start, most) in starts().iter().zip([5, 7, 8, 7]) {
            let image = Image::new(400, &truth());
            let outcome = run(&image, start, solver);
            assert_eq!(outcome.ending, Ending::Converged);
            // Convergence is quadratic: the last step, of at most 1e-5, leaves about its square.
            assert!(error(&outcome, &truth()) < 1e-8, "{}: {:e}", outcome.solver, error(&outcome, &truth()));
            assert!(outcome.evaluations <= most, "{}: {}", outcome.solver, outcome.evaluations);
            assert_eq!(outcome.evaluations, image.passes(), "every pass is counted");
            assert!(outcome.unknowns.iter().all(|u| u.identifiable && !u.at_bound));
            // Without any weight nothing shows of an exponent or a turn.
            let dark = start.params.scalar(Param::BaseWeight) == 0.0;
            assert!(outcome.unknowns.iter().all(|u| u.sensitivity > 0.0 || dark));
        }
    }
}

#[test]
fn per_channel_weights_and_gains_come_back_too() {
    let mut unknowns: Vec<Unknown> = [Param::BaseWeight, Param::Hilite]
        .into_iter()
        .flat_map(Column::per_channel)
        .map(Unknown::Param)
        .collect();
    unknowns.extend([tied(Param::RimExponent), tied(Param::Occlusion), Unknown::Gain(1, Channels::Tied)]);
    let mut truth = truth();
    truth.params.set_rgb(Param::BaseWeight, [0.9, 0.6, 0.5]);
    truth.params.set_rgb(Param::Hilite, [0.7, 0.2, 0.1]);
    truth.gains[1] = 1.7.into();
    let image = Image::new(300, &truth).with(&unknowns);
    let mut start = truth.clone();
    start.params.set(Param::BaseWeight, 1.0);
    start.params.set(Param::Hilite, 0.5);
    start.params.set(Param::RimExponent, 2.0);
    start.params.set(Param::Occlusion, 0.3);
    start.gains[1] = 1.0.into();
    for solver in [SolverKind::Varpro, SolverKind::Lm] {
        let outcome = run(&image, &start, solver);
        // As above.
        assert!(error(&outcome, &truth) < 1e-8, "{solver:?}: {:e}", error(&outcome, &truth));
        assert_eq!(outcome.unknowns.last().unwrap().unknown.name(), "gain.1");
    }
}

#[test]
fn with_only_weights_free_one_pass_is_the_fit() {
    let weights: Vec<Unknown> = nine().into_iter().filter(Unknown::linear).collect();
    let mut start = truth();
    for unknown in &weights {
        unknown.set(&mut start, 0.0);
    }
    let image = Image::new(300, &truth()).with(&weights);
    let outcome = run(&image, &start, SolverKind::Varpro);
    assert_eq!((outcome.evaluations, image.passes(), outcome.ending), (1, 1, Ending::Converged));
    // Rounding of the sums, 1e-16 times the condition of the normal equations, some 1e3.
    assert!(error(&outcome, &truth()) < 1e-11, "{:e}", error(&outcome, &truth()));
}

/// Its weights are the model's own, so that it takes a few passes where `l2` takes one or half as many.
#[test]
fn the_relative_loss_is_reweighted_to_its_minimum_in_a_few_passes() {
    let weights: Vec<Unknown> = nine().into_iter().filter(Unknown::linear).collect();
    for (unknowns, noise) in [(&weights, 0.0), (&weights, 0.1), (&nine(), 0.0), (&nine(), 0.1)] {
        let image = Image::new(400, &truth()).with(unknowns).with_loss(Loss::RelativeL2);
        let image = image.with_relative_noise(noise, 6);
        let held = |start: &Point| {
            let mut at = truth();
            unknowns.iter().for_each(|u| u.set(&mut at, u.get(start)));
            at
        };
        for start in starts() {
            for solver in [SolverKind::Varpro, SolverKind::Lm] {
                let image = image.with(unknowns);
                let outcome = run(&image, &held(&start), solver);
                assert_eq!(outcome.ending, Ending::Converged, "{solver:?}");
                // Each step leaves of the last one's error a share of about the noise; `l2` needs up to eight.
                println!("{solver:?}, noise {noise}: {} passes", outcome.evaluations);
                assert!(outcome.evaluations <= 16, "{solver:?} {noise}: {}", outcome.evaluations);
                let (loss, gradient) = image.gradient(&outcome.end);
                if noise > 0.0 {
                    // A step would gain less than 0.03^2 / 1200 of the loss: gradients are below twice the root of that
                    // times the loss and the curvature, of relative residuals below 200.
                    let most = 2.0 * (7.5e-7 * loss * 200.0).sqrt();
                    assert!(gradient.iter().all(|g| g.abs() < most), "{solver:?}: {gradient:?}");
                } else {
                    assert!(error(&outcome, &truth()) < 1e-6, "{:e}", error(&outcome, &truth()));
                }
            }
        }
    }
}

#[test]
fn variable_projection_needs_the_fewest_passes() {
    let mut passes = SolverKind::ALL.map(|_| 0);
    for seed in 0..40 {
        for (solver, total) in SolverKind::ALL.iter().zip(&mut passes) {
            // The slow ones tell enough after a few.
            if seed < 3 || matches!(solver, SolverKind::Varpro | SolverKind::Lm) {
                let image = Image::new(200, &truth()).with_noise(0.02, seed);
                run(&image, &random_start(seed), *solver);
                *total += image.passes();
            }
        }
    }
    let [varpro, lm, lbfgs, simplex, adam] = passes;
    println!(
        "passes: varpro {varpro} and lm {lm} for 40 fits; lbfgs {lbfgs}, nelder-mead {simplex} and adam {adam} for 3"
    );
    // With non-linear unknowns free both are Gauss-Newton near the answer; varpro saves where the
    // start's weights are far off.
    assert!(varpro <= lm && varpro <= 40 * 7, "varpro {varpro}, lm {lm}");
    assert!(varpro < lbfgs * 40 / 3 / 5 && lbfgs < simplex, "lbfgs {lbfgs}, nelder-mead {simplex}");
}

#[test]
fn the_comparison_solvers_find_the_same_answer() {
    let image = Image::new(200, &truth()).with_noise(0.02, 1);
    let reference = run(&image, &point(&[]), SolverKind::Varpro);
    for solver in [SolverKind::Lbfgs, SolverKind::NelderMead] {
        let outcome = run(&image, &point(&[]), solver);
        for (found, expected) in outcome.unknowns.iter().zip(&reference.unknowns) {
            // They stop when the loss changes by 1e-12 of the first one, that is by less than 1e-9 of
            // the last: within sqrt(1e-9 * 600) = 1e-3 standard errors, times a condition of 30.
            let off = (found.value - expected.value).abs() / expected.std_error.unwrap();
            assert!(off < 0.03, "{}: {} off by {off}", outcome.solver, found.unknown.name());
        }
    }
}

#[test]
fn no_solver_ends_above_its_start_or_outside_the_bounds() {
    for solver in SolverKind::ALL {
        for max_iterations in [1, 2, 3, 5] {
            for seed in 0..10 {
                let image = Image::new(60, &truth()).with_noise(0.3, seed);
                let options =
                    FitOptions { solver, max_iterations: Some(max_iterations), ..FitOptions::default() };
                let outcome = fit(&image, &random_start(seed), &options, &mut |_| {}).unwrap();
                assert!(outcome.loss_end <= outcome.loss_start, "{solver:?}");
                // What is said of the end is true: to rounding, of a loss predicted from that of a pass.
                let measured = image.loss(&outcome.end);
                assert!((measured - outcome.loss_end).abs() < 1e-9 * outcome.loss_start, "{solver:?}");
                for unknown in &outcome.unknowns {
                    let (lower, upper) = unknown.unknown.bounds();
                    assert!((lower..=upper).contains(&unknown.value));
                }
            }
        }
    }
}

/// The lowest loss over the box by cyclic search along each unknown: slow, and knows nothing of
/// derivatives or active sets.
fn search_each_in_turn(image: &Image, start: &Point) -> Point {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut at = start.clone();
    for _ in 0..2000 {
        let before = at.clone();
        for unknown in &image.unknowns {
            let (lower, upper) = unknown.bounds();
            let (mut low, mut high) = (lower.max(-3.0), upper.min(10.0));
            let value = |x: f64| {
                let mut at = at.clone();
                unknown.set(&mut at, x);
                image.loss(&at)
            };
            while high - low > 1e-9 {
                let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
                if value(a) < value(b) { high = b } else { low = a }
            }
            unknown.set(&mut at, 0.5 * (low + high));
        }
        if image.unknowns.iter().all(|u| (u.get(&at) - u.get(&before)).abs() < 3e-8) {
            return at;
        }
    }
    panic!("the search in turn does not settle")
}

#[test]
fn with_bounds_active_the_answer_is_the_best_within_the_box() {
    let unknowns = [Param::BaseWeight, Param::Hilite, Param::RimExponent, Param::Occlusion].map(tied);
    // The truth is outside the bounds of hilite (from below) and of occlusion (from above).
    let rim = (Param::RimWeight, 1.5);
    let outside = point(&[(Param::Hilite, -0.1), (Param::Occlusion, 1.3), (Param::RimExponent, 3.0), rim]);
    let start = point(&[(Param::Occlusion, 0.5), rim]);
    let image = Image::new(40, &outside).with(&unknowns);
    let expected = search_each_in_turn(&image, &start);
    for solver in [SolverKind::Varpro, SolverKind::Lm] {
        let tolerances = Tolerances { error: 0.0, ..Tolerances::default() };
        let options = FitOptions { solver, tolerances, ..FitOptions::default() };
        let outcome = fit(&image, &start, &options, &mut |_| {}).unwrap();
        assert_eq!(outcome.ending, Ending::Converged);
        assert_eq!(outcome.unknowns.each(|u| u.at_bound), [false, true, false, true]);
        assert_eq!((outcome.unknowns[1].value, outcome.unknowns[3].value), (0.0, 1.0));
        assert_eq!(outcome.unknowns[1].std_error, None);
        assert!(outcome.loss_end <= image.loss(&expected) * (1.0 + 1e-9));
        // About 1e-10 of a loss of 7.5e-3 is left to gain: with curvatures of the loss below 2, free
        // derivatives are below sqrt(2 * 2 * 7.5e-13); those at bounds push outwards.
        let (_, gradient) = image.gradient(&outcome.end);
        assert!(outcome.evaluations <= 12, "{}", outcome.evaluations);
        assert!(gradient[0].abs() < 2e-6 && gradient[2].abs() < 2e-6, "{gradient:?}");
        assert!(gradient[1] > 1e-3 && gradient[3] < -1e-3, "{gradient:?}");
        for unknown in &outcome.unknowns {
            // The search in turn creeps along valleys: with steps of 3e-8 it may be 1e4 of them away.
            let off = (unknown.value - unknown.unknown.get(&expected)).abs();
            assert!(off < 3e-4, "{solver:?} {}: {off:e}", unknown.unknown.name());
        }
    }
}

trait Each<T> {
    fn each<R>(&self, of: impl Fn(&T) -> R) -> Vec<R>;
}

impl<T> Each<T> for Vec<T> {
    fn each<R>(&self, of: impl Fn(&T) -> R) -> Vec<R> {
        self.iter().map(of).collect()
    }
}

#[test]
fn robust_losses_hold_out_against_outliers() {
    let image = Image::new(400, &truth()).with_noise(0.01, 2).with_outliers(10, 1.5);
    let off = |loss| {
        let outcome = run(&image.with_loss(loss), &point(&[]), SolverKind::Varpro);
        assert_eq!(outcome.ending, Ending::Converged, "{loss:?}");
        (error(&outcome, &truth()), outcome.evaluations)
    };
    let (l2, _) = off(Loss::L2);
    let (huber, huber_passes) = off(Loss::Huber);
    let (smape, smape_passes) = off(Loss::Smape);
    println!(
        "worst relative error: l2 {l2:.3}, huber {huber:.3} ({huber_passes} passes), smape {smape:.3} ({smape_passes})"
    );
    // A tenth of the pixels is off by 1.5: Huber counts each like 0.05, a thirtieth; SMAPE by at most 1.
    assert!(huber < 0.25 * l2 && smape < 0.25 * l2);
    assert!(huber_passes <= 20 && smape_passes <= 60);
}

#[test]
fn a_robust_loss_with_only_weights_free_reweights_to_its_minimum() {
    let weights: Vec<Unknown> = nine().into_iter().filter(Unknown::linear).collect();
    let image = Image::new(200, &truth()).with(&weights).with_outliers(10, 1.5).with_loss(Loss::Huber);
    let start = Point { params: truth().params, ..point(&[]) };
    let outcome = run(&image, &start, SolverKind::Varpro);
    assert_eq!(outcome.ending, Ending::Converged);
    // At the minimum the gradient vanishes: steps gain less than 1e-8 of the loss, so that the gradient
    // is below sqrt(1e-8 * loss * curvature), with curvatures below 2.
    let (loss, gradient) = image.gradient(&outcome.end);
    for g in gradient {
        assert!(g.abs() < (1e-8 * loss * 2.0).sqrt() * 2.0, "{g:e}");
    }
}

#[test]
fn sums_of_single_precision_are_fitted_to_their_rounding() {
    for noise in [0.0, 0.02] {
        let mut image = Image::new(400, &truth()).with_noise(noise, 4);
        let exact = run(&image, &point(&[]), SolverKind::Varpro);
        image.single_precision = true;
        for solver in [SolverKind::Varpro, SolverKind::Lm] {
            let outcome = run(&image, &point(&[]), solver);
            assert_eq!(outcome.ending, Ending::Converged, "{solver:?}");
            assert!(outcome.evaluations <= 8, "{solver:?}: {}", outcome.evaluations);
            for (single, double) in outcome.unknowns.iter().zip(&exact.unknowns) {
                // 6e-8 of each value, times a condition of some 100.
                let off = (single.value - double.value).abs() / double.value.abs();
                assert!(off < 1e-5, "{}: {off:e}", single.unknown.name());
            }
        }
    }
}

/// From there the sums agree in all their digits before and after the weights are solved for.
#[test]
fn an_extreme_start_of_a_weight_ends_where_others_do() {
    let mut image = Image::new(400, &truth());
    image.single_precision = true;
    for start in [1e4, 1e6, 1e9] {
        let outcome = run(&image, &point(&[(Param::Hilite, start)]), SolverKind::Varpro);
        assert_eq!(outcome.ending, Ending::Converged, "{start:e}");
        // As from any start: 6e-8 of each value, times a condition of some 100.
        let off = error(&outcome, &truth());
        assert!(off < 1e-5, "{start:e}: {off:e}");
    }
}

#[test]
fn many_starts_leave_a_local_minimum() {
    let unknowns = [Param::BaseWeight, Param::EnvironmentRotation].map(tied);
    let mut image = Image::new(150, &truth()).with(&unknowns);
    image.ripple = 0.5;
    let image = image.towards(&truth());
    // A third of a turn on, the light looks much the same: a fit from there stays there.
    let mut start = truth();
    start.params.set(Param::EnvironmentRotation, 130.0);
    let alone = run(&image, &start, SolverKind::Varpro);
    assert!(alone.loss_end > 1e-4, "the test needs a local minimum: {}", alone.loss_end);
    let options = FitOptions { starts: 16, seed: 1, ..FitOptions::default() };
    let outcome = fit(&image, &start, &options, &mut |_| {}).unwrap();
    assert!(outcome.loss_end < 1e-20, "{}", outcome.loss_end);
    assert_eq!(outcome.starts.len(), 16);
    assert_eq!(outcome.starts[0].loss_end, alone.loss_end, "the first start is the given one");
    let best = outcome.starts.iter().map(|start| start.loss_end).fold(f64::INFINITY, f64::min);
    assert_eq!(outcome.loss_end, best);
    assert_eq!(outcome.loss_start, alone.loss_start);
    let again = fit(&image, &start, &options, &mut |_| {}).unwrap();
    assert_eq!((again.end, again.starts), (outcome.end, outcome.starts), "the seed decides");
}
