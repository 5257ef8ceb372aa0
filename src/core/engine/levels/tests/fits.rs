//! Fits of what is computed in texels.

use super::*;
use crate::fit::{FitOptions, fit};

#[test]
fn fits_recover_what_made_their_targets_and_make_levels_no_more_often_than_they_move() {
    let [weight, radius] = [0, 1].map(|i| hills().params[i]);
    let own = setup(&[hills()]);
    let mut truth = start(&[(radius, 1.9)]);
    truth.params.set_rgb(weight, [0.9, 0.6, 0.4]);
    let mut unknowns = free(&Column::per_channel(weight));
    // Weights alone: levels are made once, for the image of the targets apart.
    let mut begin = truth.clone();
    begin.params.set_rgb(weight, [0.2; 3]);
    let engine = engine_for(own, unknowns.clone(), &truth);
    assert_eq!(engine.levels_made(), 0);
    let outcome = fit(&engine, &begin, &FitOptions::default(), &mut |_| {}).unwrap();
    for (got, want) in outcome.end.params.rgb(weight).into_iter().zip([0.9, 0.6, 0.4]) {
        // Targets round to 6e-8.
        assert!((got - want).abs() < 1e-5, "{got} {want}");
    }
    assert_eq!(engine.levels_made(), 1);
    // And the radius, in which the model is not linear.
    unknowns.push(Unknown::Param(Column::tied(radius)));
    begin.params.set(radius, 1.2);
    let engine = engine_for(own, unknowns, &truth);
    let outcome = fit(&engine, &begin, &FitOptions::default(), &mut |_| {}).unwrap();
    let got = outcome.end.params.scalar(radius);
    // The blur has kinks where taps cross texels; the fit ends at roundings all the same.
    assert!((got - 1.9).abs() < 1e-3, "{got}");
    assert!(engine.levels_made() > 1);

    let [width, depth] = [0, 1].map(|i| furrows().params[i]);
    let truth = start(&[(width, 0.08), (depth, 1.2)]);
    let begin = start(&[(width, 0.05), (depth, 1.7)]);
    let unknowns = free(&[Column::tied(width), Column::tied(depth)]);
    let engine = engine_for(setup(&[furrows()]), unknowns, &truth);
    let outcome = fit(&engine, &begin, &FitOptions::default(), &mut |_| {}).unwrap();
    let got = [width, depth].map(|param| outcome.end.params.scalar(param));
    assert!((got[0] - 0.08).abs() < 1e-4 && (got[1] - 1.2).abs() < 1e-4, "{got:?}");
}
