//! What is known of an answer, and what cannot be.

use nalgebra::{DMatrix, DVector};

use super::image::{Altered, Image, nine, point, tied, truth};
use super::{Each, run, starts};
use skinfit::engine::{NormalEquations, Objective, Point, Unknown};
use skinfit::fit::outcome::Ending;
use skinfit::fit::{FitError, FitOptions, SolverKind, fit};
use skinfit::model::params::{Channels, Param};

#[test]
fn with_noise_the_truth_lies_as_far_away_as_the_standard_errors_say() {
    let k = nine().len();
    let (mut chi_square, mut beyond_three, mut beyond_one) = (0.0, 0, 0);
    let seeds = 20;
    for seed in 0..seeds {
        let image = Image::new(500, &truth()).with_noise(0.02, 100 + seed);
        let outcome = run(&image, &point(&[]), SolverKind::Varpro);
        let z = outcome.unknowns.each(|u| (u.value - u.unknown.get(&truth())) / u.std_error.unwrap());
        beyond_three += z.iter().filter(|z| z.abs() > 3.0).count();
        beyond_one += z.iter().filter(|z| z.abs() > 1.0).count();
        let correlations = DMatrix::from_row_slice(k, k, &outcome.correlations);
        let z = DVector::from_vec(z);
        chi_square += z.dot(
            &correlations
                .try_inverse()
                .unwrap()
                .column_iter()
                .zip(z.iter())
                .fold(DVector::zeros(k), |sum, (column, z)| sum + column * *z),
        );
    }
    println!(
        "chi square {chi_square:.0} of 180; {beyond_one} beyond 1 and {beyond_three} beyond 3 standard errors"
    );
    // z'R^-1 z of each seed is chi-square of 9 degrees, the sum of 20 of 180: 180 with a standard
    // deviation of sqrt(360) = 19, of which four are allowed.
    assert!((chi_square - 180.0).abs() < 4.0 * 19.0, "{chi_square}");
    // Of 180 normal numbers 0.5 lie beyond 3; correlated within a seed, 4 have a chance below 1%.
    assert!(beyond_three < 4, "{beyond_three}");
    // 57 lie beyond 1 (32%), with a standard deviation of 6 were they independent; 20 with correlations.
    assert!((37..=77).contains(&beyond_one), "{beyond_one}");
}

#[test]
fn standard_errors_do_not_depend_on_the_solver() {
    let image = Image::new(200, &truth()).with_noise(0.02, 7);
    let reference = run(&image, &point(&[]), SolverKind::Lm);
    for solver in SolverKind::ALL {
        let outcome = run(&image, &point(&[]), solver);
        for (found, expected) in outcome.unknowns.iter().zip(&reference.unknowns) {
            let ratio = found.std_error.unwrap() / expected.std_error.unwrap();
            // The Jacobians are taken within 0.03 standard errors of each other, which are a few percent
            // of the values.
            assert!((ratio - 1.0).abs() < 1e-2, "{solver:?} {}: {ratio}", found.unknown.name());
        }
    }
}

#[test]
fn what_no_pixel_asks_for_stays_at_its_start_and_is_named() {
    let image = Image::new(200, &truth()).without_specular_map().towards(&truth());
    let mut unknowns = nine();
    unknowns.push(tied(Param::NormalStrength));
    let start = point(&[(Param::SideSpecular, 0.37), (Param::NormalStrength, 1.21)]);
    for solver in SolverKind::ALL {
        let image = image.with(&unknowns);
        let outcome = run(&image, &start, solver);
        let unidentified = outcome.unknowns.iter().filter(|u| !u.identifiable);
        let names: Vec<_> = unidentified.map(|u| u.unknown.name()).collect();
        assert_eq!(names, ["side_specular", "normal_strength"], "{solver:?}");
        if matches!(solver, SolverKind::Varpro | SolverKind::Lm) {
            assert_eq!(outcome.unknowns[5].value, 0.37, "{solver:?}");
            assert_eq!(outcome.unknowns[9].value, 1.21, "{solver:?}");
        }
        assert_eq!(outcome.unknowns[5].std_error, None);
        assert_eq!(outcome.unknowns[5].sensitivity, 0.0);
        assert_eq!(outcome.undetermined.len(), 2);
        assert_eq!(outcome.undetermined[0].components, [("side_specular".to_owned(), 1.0)]);
        // The others are found as ever.
        assert!((outcome.unknowns[2].value - 3.2).abs() < 1e-3, "{solver:?}: {}", outcome.unknowns[2].value);
    }
}

#[test]
fn the_ambiguity_of_gains_and_weights_is_found_and_holding_one_gain_resolves_it() {
    for single_precision in [false, true] {
        let mut image = Image::new(400, &truth()).with_noise(0.01, 3);
        image.single_precision = single_precision;
        let mut unknowns = nine();
        unknowns.push(Unknown::Gain(1, Channels::Tied));
        for solver in [SolverKind::Varpro, SolverKind::Lm] {
            // The first view's gain held at 1: everything is determined.
            let held = run(&image.with(&unknowns), &point(&[]), solver);
            assert!(held.undetermined.is_empty() && held.unknowns.iter().all(|u| u.identifiable));

            let mut both = unknowns.clone();
            both.push(Unknown::Gain(0, Channels::Tied));
            let free = run(&image.with(&both), &point(&[]), solver);
            assert_eq!(free.ending, Ending::Converged, "{solver:?}");
            assert_eq!(free.undetermined.len(), 1, "{solver:?}");
            let direction = &free.undetermined[0].components;
            let mut named: Vec<_> = direction.iter().map(|(name, _)| name.as_str()).collect();
            named.sort_unstable();
            let weights =
                ["base_weight", "gain.0", "gain.1", "hilite", "reflection", "rim_weight", "side_specular"];
            assert_eq!(named, weights);
            for unknown in &free.unknowns {
                let name = unknown.unknown.name();
                assert_eq!(unknown.identifiable, !weights.contains(&name.as_str()), "{name}");
                assert_eq!(unknown.std_error.is_some(), unknown.identifiable);
                // Along it weights grow as they are, and gains shrink as they are.
                if let Some((_, component)) = direction.iter().find(|(n, _)| *n == name) {
                    let grows = if name.starts_with("gain") { -1.0 } else { 1.0 };
                    let base = direction.iter().find(|(n, _)| n == "base_weight").unwrap().1;
                    let rate = component / unknown.value / (base / free.unknowns[0].value);
                    // Eigenvectors of a matrix with relative noise 1e-9 beside eigenvalues above 1e-4.
                    assert!((rate - grows).abs() < 1e-3, "{name}: {rate}");
                }
            }
            // The image is fitted all the same.
            assert!((free.loss_end / held.loss_end - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn fewer_residuals_than_unknowns_are_fitted_and_said_to_be_too_few() {
    for pixels in [1, 2] {
        let image = Image::new(pixels, &truth());
        for solver in [SolverKind::Varpro, SolverKind::Lm] {
            let outcome = run(&image, &point(&[]), solver);
            assert!(
                outcome.loss_end <= 1e-6 * outcome.loss_start,
                "{solver:?} {pixels}: {}",
                outcome.loss_end
            );
            // Each undetermined direction is one too many.
            assert!(outcome.undetermined.len() >= 9 - 3 * pixels, "{solver:?} {:?}", outcome.undetermined);
            assert!(outcome.unknowns.iter().all(|u| u.value.is_finite() && u.std_error.is_none()));
        }
    }
}

#[test]
fn without_unknowns_the_outcome_is_the_start_and_its_loss() {
    let image = Image::new(30, &truth()).with(&[]);
    for solver in SolverKind::ALL {
        let outcome = run(&image, &point(&[]), solver);
        assert_eq!((outcome.end, outcome.loss_end), (point(&[]), image.loss(&point(&[]))));
        assert_eq!((outcome.evaluations, outcome.ending), (1, Ending::Converged));
        assert!(outcome.unknowns.is_empty() && outcome.undetermined.is_empty());
    }
}

/// An image whose loss and a derivative are spoilt beyond a given hilite.
fn spoilt(image: &Image, beyond: f64, loss: f64, derivative: f64) -> impl Objective {
    let alter = move |point: &Point, sums: &mut NormalEquations| {
        if point.params.scalar(Param::Hilite) > beyond {
            sums.loss += loss;
            sums.jtr[1] += derivative;
        }
    };
    Altered { image: image.clone(), alter }
}

#[test]
fn a_start_that_is_no_place_to_begin_is_refused() {
    let image = Image::new(30, &truth());
    let fail = |objective: &dyn Objective, start: &Point| {
        fit(objective, start, &FitOptions::default(), &mut |_| {}).unwrap_err()
    };
    let spoilt = |loss, derivative| spoilt(&image, 0.0, loss, derivative);
    let error = fail(&spoilt(f64::NAN, 0.0), &point(&[])).to_string();
    assert!(error.contains("the loss at the start is NaN"), "{error}");
    let error = fail(&spoilt(0.0, f64::INFINITY), &point(&[])).to_string();
    assert!(error.contains("derivative of the loss by rim_weight at the start is inf"), "{error}");
    let error = fail(&image, &point(&[(Param::Occlusion, 1.5)])).to_string();
    assert!(error.contains("occlusion is 1.5, outside its bounds 0 to 1"), "{error}");
    let error = fail(&image, &point(&[(Param::RimWeight, f64::NAN)])).to_string();
    assert!(error.contains("rim_weight is NaN"), "{error}");
    assert!(matches!(fail(&Image::new(0, &truth()), &point(&[])), FitError::Empty));
}

/// An image that says to a solver that asks for no normal equations that there is nowhere to go.
struct Level(Image);

impl Objective for Level {
    fn unknowns(&self) -> &[Unknown] {
        self.0.unknowns()
    }
    fn normal_equations(&self, point: &Point) -> NormalEquations {
        self.0.normal_equations(point)
    }
    fn loss(&self, point: &Point) -> f64 {
        self.0.loss(point)
    }
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        (self.0.loss(point), vec![0.0; self.0.unknowns.len()])
    }
}

#[test]
fn a_solver_that_stops_where_the_normal_equations_promise_more_has_stalled() {
    let image = Image::new(100, &truth()).with_noise(0.02, 3);
    let outcome = run(&Level(image.clone()), &point(&[]), SolverKind::Lbfgs);
    assert_eq!(outcome.ending, Ending::Stalled);
    // The same solver with the true gradient is at the answer, and so is believed.
    assert_eq!(run(&image, &point(&[]), SolverKind::Lbfgs).ending, Ending::Converged);
}

#[test]
fn a_solver_that_calls_itself_converged_is_at_the_answer() {
    let image = Image::new(200, &truth()).with_noise(0.02, 1);
    let best = run(&image, &point(&[]), SolverKind::Varpro).loss_end;
    // Far out on the transforms of two weights: by their logarithms, the loss has hardly a slope there.
    let mut converged = 0;
    let flat = point(&[(Param::Reflection, 1e-2), (Param::Hilite, 1e-10), (Param::SideSpecular, 1e-10)]);
    for start in [point(&[]), flat].iter().chain(&starts()) {
        for solver in [SolverKind::Lbfgs, SolverKind::NelderMead] {
            let outcome = run(&image, start, solver);
            let above = outcome.loss_end / best - 1.0;
            match outcome.ending {
                // Less than a thousandth was left to gain, by a model that is quadratic about the answer.
                Ending::Converged => assert!(above < 2e-3, "{solver:?}: {above:e} above the answer"),
                Ending::Stalled => assert!(above > 5e-4, "{solver:?}: only {above:e} above the answer"),
                // A simplex may need more than it is given, and says so.
                Ending::RanOut => assert_eq!(solver, SolverKind::NelderMead),
                Ending::Interrupted => panic!("nobody pressed Ctrl-C"),
            }
            converged += u32::from(outcome.ending == Ending::Converged);
        }
    }
    assert!(converged >= 6, "only {converged} of 12 fits got there");
}

#[test]
fn a_solver_turns_back_from_where_the_loss_is_not_finite() {
    // The truth has hilite 0.45; on the way from 0 no solver may be caught beyond 0.6.
    let image =
        Image::new(100, &truth()).with(&[Param::BaseWeight, Param::Hilite, Param::RimExponent].map(tied));
    let mut start = truth();
    start.params.set(Param::Hilite, 0.1);
    start.params.set(Param::RimExponent, 1.0);
    for solver in SolverKind::ALL {
        let spoilt = spoilt(&image, 0.6, f64::NAN, f64::NAN);
        let outcome = run(&spoilt, &start, solver);
        assert!(outcome.loss_end < 1e-6 * outcome.loss_start, "{solver:?}: {}", outcome.loss_end);
    }
}
