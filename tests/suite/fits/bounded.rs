//! Bounds that a scene sets for what is fitted.

use skinfit::fit::{FitError, FitOptions, SolverKind, fit};
use skinfit::model::bounds::Bounds;
use skinfit::model::params::Param;

use super::image::{Image, point, truth};

/// A fit that keeps the hilite within these.
fn within(lower: f64, upper: f64) -> FitOptions {
    let mut bounds = Bounds::default();
    bounds.set(Param::Hilite, [lower, upper]);
    FitOptions { bounds: vec![bounds], ..FitOptions::default() }
}

#[test]
fn solvers_end_on_a_bound_that_leaves_the_truth_out() {
    let truth = truth();
    let image = Image::new(300, &truth);
    let most = 0.5 * truth.params.scalar(Param::Hilite);
    let start = point(&[(Param::Hilite, 0.5 * most)]);
    for solver in SolverKind::ALL {
        let options = FitOptions { solver, ..within(0.1 * most, most) };
        let outcome = fit(&image, &start, &options, &mut |_| {}).unwrap();
        let hilite = outcome.unknowns.iter().find(|u| u.unknown.name() == "hilite").unwrap();
        assert_eq!(hilite.bounds, (0.1 * most, most));
        assert!((0.1 * most..=most).contains(&hilite.value), "{solver:?}: {}", hilite.value);
        // By transforms a bound is never reached.
        if matches!(solver, SolverKind::Varpro | SolverKind::Lm) {
            assert!(hilite.value == most && hilite.at_bound && hilite.std_error.is_none(), "{solver:?}");
        }
    }
}

#[test]
fn starts_are_drawn_within_bounds_and_one_without_is_refused() {
    let truth = truth();
    let image = Image::new(100, &truth);
    let given = truth.params.scalar(Param::Hilite);
    let options = FitOptions { starts: 6, ..within(0.9 * given, 1.1 * given) };
    let outcome = fit(&image, &point(&[(Param::Hilite, given)]), &options, &mut |_| {}).unwrap();
    assert!(outcome.unknowns.iter().all(|u| (u.bounds.0..=u.bounds.1).contains(&u.value)));
    let outside = fit(&image, &point(&[(Param::Hilite, 2.0 * given)]), &options, &mut |_| {});
    assert!(matches!(outside, Err(FitError::OutOfBounds { name, .. }) if name == "hilite"));
}
