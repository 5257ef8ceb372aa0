//! Standard errors where neighbouring residuals are alike, where noise grows with the light, and along valleys.

use skinfit::engine::Unknown;
use skinfit::fit::error_basis::ErrorBasis;
use skinfit::fit::outcome::Outcome;
use skinfit::fit::{FitOptions, fit};
use skinfit::model::params::Param;
use skinfit::scene::Loss;

use super::image::{Image, nine, point, tied, truth};

/// Pixels along a side of a view, and of a patch of noise.
const WIDTH: usize = 96;
const SIDE: usize = 4;

fn known(image: &Image, widths: &[usize]) -> Outcome {
    let options = FitOptions { widths: widths.to_vec(), ..FitOptions::default() };
    fit(image, &point(&[]), &options, &mut |_| {}).unwrap()
}

/// Mean squares of the distances from the truth, in standard errors and in errors of independent residuals.
fn mean_squares(outcomes: &[Outcome]) -> [f64; 2] {
    let truth = truth();
    let off = |of: fn(&skinfit::fit::outcome::UnknownOutcome) -> Option<f64>| {
        let all = outcomes.iter().flat_map(|outcome| &outcome.unknowns);
        let z: Vec<f64> = all.map(|u| (u.value - u.unknown.get(&truth)) / of(u).unwrap()).collect();
        z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64
    };
    [off(|u| u.std_error), off(|u| u.noise_error)]
}

#[test]
fn where_residuals_are_alike_in_squares_errors_are_those_of_as_many_draws() {
    let clean = Image::patched(WIDTH, SIDE, &truth());
    let outcomes: Vec<Outcome> =
        (0..20).map(|seed| known(&clean.with_patches_of_noise(SIDE, 0.05, seed), &[WIDTH; 2])).collect();
    for outcome in &outcomes {
        let ErrorBasis::Blocks(blocks) = outcome.errors else { panic!("{:?}", outcome.errors) };
        assert!((4..=8).contains(&blocks.alike), "{blocks:?}");
        // Of four neighbours in a row three are of one patch; 1152 patches of three channels tell it to 0.03.
        assert!((blocks.next - 0.75).abs() < 0.1, "{blocks:?}");
        // Sixteen pixels are one draw: errors are four times those of independent ones, told by some 70 squares.
        assert!((2.5..8.0).contains(&outcome.most_over_noise().unwrap()), "{:?}", outcome.most_over_noise());
    }
    let [sandwich, independent] = mean_squares(&outcomes);
    println!("mean square distance: {sandwich:.2} in standard errors, {independent:.1} in those of noise");
    // 180 distances that hang together within a fit like some 60: a mean square varies by sqrt(2 / 60) = 0.18 of itself.
    // Seventy squares for nine unknowns, which fit part of them, come out a tenth or two too small.
    assert!((0.5..1.9).contains(&sandwich), "{sandwich}");
    assert!((8.0..26.0).contains(&independent), "{independent}");
}

#[test]
fn of_independent_residuals_both_errors_are_the_same_but_for_chance() {
    let clean = Image::patched(WIDTH, 1, &truth());
    let outcomes: Vec<Outcome> =
        (0..10).map(|seed| known(&clean.with_noise(0.05, seed), &[WIDTH; 2])).collect();
    for outcome in &outcomes {
        let ErrorBasis::Blocks(blocks) = outcome.errors else { panic!("{:?}", outcome.errors) };
        assert_eq!((blocks.alike, blocks.side, blocks.count), (1, 8, 288), "{blocks:?}");
        // 288 squares tell a deviation to 4%; of nine unknowns the greatest is twice as far off.
        assert!(outcome.most_over_noise().unwrap() < 1.2, "{:?}", outcome.most_over_noise());
        assert!(outcome.unknowns.iter().all(|u| u.std_error >= u.noise_error));
    }
    // As above, of half as many fits.
    let [sandwich, _] = mean_squares(&outcomes);
    assert!((0.4..1.8).contains(&sandwich), "{sandwich}");
    // Without widths nothing is known of neighbours.
    let blind = known(&clean.with_noise(0.05, 0), &[]);
    assert_eq!(blind.errors, ErrorBasis::Independent);
    assert!(blind.unknowns.iter().all(|u| u.std_error == u.noise_error && u.std_error.is_some()));
}

#[test]
fn the_relative_loss_is_unbiased_by_noise() {
    let clean = Image::patched(WIDTH, 1, &truth()).with_loss(Loss::RelativeL2);
    let outcomes: Vec<Outcome> =
        (0..12).map(|seed| known(&clean.with_relative_noise(0.2, seed), &[WIDTH; 2])).collect();
    let truth = truth();
    for (i, unknown) in nine().iter().enumerate() {
        let mean =
            |of: &dyn Fn(&Outcome) -> f64| outcomes.iter().map(of).sum::<f64>() / outcomes.len() as f64;
        let error = mean(&|o| o.unknowns[i].std_error.unwrap());
        let bias = mean(&|o| o.unknowns[i].value) - unknown.get(&truth);
        // Twelve draws leave of a standard error 0.29; of nine the furthest is expected 1.6 of those away, hardly any
        // beyond 4. The loss that divides by the target is off by some 4% of every weight, many standard errors.
        assert!(bias.abs() < 4.0 * 0.29 * error, "{}: {bias:e} of {error:e}", unknown.name());
    }
    // 108 distances, of which some 36 are independent: 0.24 of itself.
    let [sandwich, independent] = mean_squares(&outcomes);
    assert!((0.4..1.9).contains(&sandwich) && (0.4..1.9).contains(&independent), "{sandwich} {independent}");
}

#[test]
fn a_profile_ends_where_the_loss_has_risen_by_what_an_error_stands_for() {
    let image = Image::new(120, &truth()).with_noise(0.25, 3);
    let options = FitOptions { profile: true, ..FitOptions::default() };
    let outcome = fit(&image, &point(&[]), &options, &mut |_| {}).unwrap();
    let profile = outcome.profile.as_ref().unwrap();
    let held = outcome.constant(&profile.name).unwrap();
    assert!(!held.unknown.linear() && !held.at_bound, "{profile:?}");
    assert_eq!((profile.value, profile.std_error), (held.value, held.std_error.unwrap()));
    assert!(profile.closed.contains(&true), "{profile:?}");
    assert!(profile.points.is_sorted_by(|a, b| a.value < b.value) && profile.passes >= 2, "{profile:?}");
    let others: Vec<Unknown> = nine().into_iter().filter(|u| *u != held.unknown).collect();
    for end in (0..2).filter(|&end| profile.closed[end]) {
        let mut start = outcome.end.clone();
        held.unknown.set(&mut start, profile.interval[end]);
        let again = fit(&image.with(&others), &start, &FitOptions::default(), &mut |_| {}).unwrap();
        let rise = (again.loss_end - outcome.loss_end) / profile.rise;
        // Between two places the root of the rise is taken for straight, over a factor of two in the distance.
        assert!((0.6..1.6).contains(&rise), "{rise} at end {end} of {profile:?}");
    }
}

#[test]
fn what_is_well_determined_or_linear_has_no_profile() {
    let options = FitOptions { profile: true, ..FitOptions::default() };
    let sharp = Image::new(400, &truth()).with_noise(0.002, 1);
    assert!(fit(&sharp, &point(&[]), &options, &mut |_| {}).unwrap().profile.is_none());
    let weights: Vec<Unknown> = [Param::BaseWeight, Param::Hilite].map(tied).to_vec();
    let linear = Image::new(400, &truth()).with_noise(0.5, 1).with(&weights);
    assert!(fit(&linear, &point(&[]), &options, &mut |_| {}).unwrap().profile.is_none());
}
