//! Interrupted fits, and what they leave.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::image::{Image, nine, point, tied, truth};
use super::random_start;
use skinfit::engine::Point;
use skinfit::fit::fingerprint::Fingerprint;
use skinfit::fit::outcome::{Ending, Outcome};
use skinfit::fit::{FitError, FitOptions, SolverKind, fit};
use skinfit::model::params::Param;
use skinfit::scene::Loss;

fn options(solver: SolverKind, state: &Path) -> FitOptions {
    let fingerprint = Fingerprint::default().with("mesh", "a head");
    FitOptions { solver, fingerprint, state: Some(state.to_owned()), ..FitOptions::default() }
}

/// Fit until `iterations` are done, then press Ctrl-C.
fn interrupted(image: &Image, start: &Point, options: &FitOptions, iterations: u64) -> Outcome {
    let flag = Arc::new(AtomicBool::new(false));
    let options = FitOptions { interrupt: Some(flag.clone()), ..options.clone() };
    let mut seen = 0;
    let mut watch = |_: &_| {
        seen += 1;
        flag.store(seen > iterations, Ordering::SeqCst);
    };
    fit(image, start, &options, &mut watch).unwrap()
}

fn resumed(image: &Image, start: &Point, options: &FitOptions) -> Result<Outcome, FitError> {
    fit(image, start, &FitOptions { resume: options.state.clone(), ..options.clone() }, &mut |_| {})
}

#[test]
fn an_interrupted_fit_goes_on_to_the_same_end_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state.json");
    for solver in [SolverKind::Varpro, SolverKind::Lm] {
        for (loss, starts) in [(Loss::L2, 1), (Loss::Huber, 1), (Loss::L2, 3)] {
            for iterations in 0..8 {
                let image = Image::new(100, &truth()).with_noise(0.05, 3).with_loss(loss);
                let start = random_start(iterations);
                let options = FitOptions { starts, seed: 5, ..options(solver, &state) };
                let whole = fit(&image, &start, &options, &mut |_| {}).unwrap();
                let before = interrupted(&image, &start, &options, iterations);
                if before.ending != Ending::Interrupted {
                    assert!(iterations > 2, "it should not be done after {iterations}");
                    continue;
                }
                let after = resumed(&image, &start, &options).unwrap();
                assert_eq!(after.end, whole.end);
                assert_eq!(after.loss_end.to_bits(), whole.loss_end.to_bits());
                assert_eq!((after.ending, &after.starts), (whole.ending, &whole.starts));
                assert_eq!((after.iterations, after.evaluations), (whole.iterations, whole.evaluations));
                let losses =
                    |o: &Outcome| o.history.iter().map(|i| (i.iteration, i.loss)).collect::<Vec<_>>();
                assert_eq!(losses(&after), losses(&whole));
                assert!(after.seconds >= before.seconds);
            }
        }
    }
}

#[test]
fn argmins_solvers_resume_from_the_best_point() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state.json");
    for solver in [SolverKind::Lbfgs, SolverKind::NelderMead] {
        let image = Image::new(60, &truth()).with_noise(0.02, 3);
        let options = options(solver, &state);
        let whole = fit(&image, &point(&[]), &options, &mut |_| {}).unwrap();
        let before = interrupted(&image, &point(&[]), &options, 20);
        assert_eq!((before.ending, before.iterations), (Ending::Interrupted, 20));
        let after = resumed(&image, &point(&[]), &options).unwrap();
        // They stop where the loss changes by less than 1e-12 of the first; the path differs.
        assert!((after.loss_end / whole.loss_end - 1.0).abs() < 1e-6, "{solver:?}");
        assert!(after.evaluations > before.evaluations);
        assert!(after.history.windows(2).all(|pair| pair[1].loss <= pair[0].loss));
    }
}

#[test]
fn a_finished_fit_resumed_says_the_same_without_another_pass() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state.json");
    let image = Image::new(60, &truth());
    for solver in [SolverKind::Varpro, SolverKind::Lbfgs] {
        let options = options(solver, &state);
        let whole = fit(&image, &point(&[]), &options, &mut |_| {}).unwrap();
        let passes = image.passes();
        let after = resumed(&image, &point(&[]), &options).unwrap();
        assert_eq!(image.passes(), passes);
        assert_eq!((after.end, after.evaluations), (whole.end, whole.evaluations));
    }
}

#[test]
fn a_fit_that_ran_out_goes_on_when_given_more_iterations() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(SolverKind::Varpro, &folder.path().join("state.json"));
    let image = Image::new(60, &truth());
    let whole = fit(&image, &point(&[]), &options, &mut |_| {}).unwrap();
    let short = FitOptions { max_iterations: Some(2), ..options.clone() };
    let before = fit(&image, &point(&[]), &short, &mut |_| {}).unwrap();
    assert_eq!((before.ending, before.iterations), (Ending::RanOut, 2));
    assert_eq!(resumed(&image, &point(&[]), &options).unwrap().end, whole.end);
}

#[test]
fn the_state_of_another_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.json");
    let image = Image::new(60, &truth());
    let options = options(SolverKind::Varpro, &path);
    fit(&image, &point(&[]), &options, &mut |_| {}).unwrap();
    let fewer = image.with(&nine()[..4]);
    let elsewhere = point(&[(Param::Hilite, 0.1)]);
    let other = |change: fn(&mut FitOptions)| {
        let mut options = options.clone();
        change(&mut options);
        options
    };
    #[rustfmt::skip]
    let cases = [
        (&image, point(&[]), other(|o| o.fingerprint = Fingerprint::default().with("mesh", "a hand")), "its mesh differs (a head; now a hand)"),
        (&image, point(&[]), other(|o| o.fingerprint = Fingerprint::default()), "its mesh differs (a head; now none)"),
        (&image, point(&[]), other(|o| o.fingerprint = o.fingerprint.clone().with("map", "x")), "its map differs (none; now x)"),
        (&image, point(&[]), other(|o| o.solver = SolverKind::Lm), "its solver differs (varpro; now lm)"),
        (&image, point(&[]), other(|o| o.starts = 2), "its number of starts differs"),
        (&image, point(&[]), other(|o| o.seed = 2), "its seed differs"),
        (&image, elsewhere, options.clone(), "its start differs"),
        (&fewer, point(&[]), options.clone(), "its list of unknowns differs"),
    ];
    for (image, start, options, what) in cases {
        let error = resumed(image, &start, &options).unwrap_err().to_string();
        assert!(error.contains(what) && error.contains("state.json"), "{error}");
        assert!(error.contains("start afresh"), "it says what to do: {error}");
    }
}

#[test]
fn a_damaged_or_missing_state_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.json");
    let image = Image::new(60, &truth());
    let options = options(SolverKind::Varpro, &path);
    let error = resumed(&image, &point(&[]), &options).unwrap_err().to_string();
    assert!(error.contains("cannot be read"), "{error}");
    interrupted(&image, &point(&[]), &options, 2);
    let whole = std::fs::read_to_string(&path).unwrap();
    let damaged = [
        String::new(),
        whole[..whole.len() / 2].to_owned(),
        "{}".to_owned(),
        whole.replacen("\"damping\"", "\"dumping\"", 1),
        whole.replacen("\"scaling\":[", "\"scaling\":[1.0,", 1),
        whole.replacen("\"at\":[", "\"at\":[1.0,", 1),
        whole.replacen("\"moved\":", "\"moved\":-", 1),
    ];
    for text in damaged {
        std::fs::write(&path, &text).unwrap();
        let error = resumed(&image, &point(&[]), &options).unwrap_err().to_string();
        assert!(error.contains("not a state that a fit has left"), "{error}");
    }
}

#[test]
fn a_state_that_cannot_be_written_is_an_error_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file");
    std::fs::write(&file, "no folder").unwrap();
    let image = Image::new(60, &truth()).with(&[tied(Param::RimExponent)]);
    for solver in SolverKind::ALL {
        let before = image.passes();
        let options = options(solver, &file.join("state.json"));
        let error = fit(&image, &point(&[]), &options, &mut |_| {}).unwrap_err().to_string();
        assert!(error.contains("cannot be written"), "{error}");
        // The start, and a simplex for one unknown.
        assert!(image.passes() - before <= 4);
    }
}
