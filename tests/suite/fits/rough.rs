//! Losses whose slopes say, but for a part, what the loss does, as those of blurs do whose taps fall between texels.

use skinfit::engine::{NormalEquations, Objective, Point};
use skinfit::fit::outcome::{Ending, Outcome};
use skinfit::fit::{FitOptions, SolverKind, Tolerances, fit};

use super::image::{Altered, Image, point, truth};

/// How far a slope is off, as a share of the most that the residuals and its column allow (Cauchy and Schwarz): about that of
/// a radius on the scanned head.
const OFF: f64 = 2e-3;

/// An image whose slopes along curved unknowns are off, this way and that from place to place; how fast that changes is `fine`:
/// what is left of a large multiple looks like chance.
fn rough(image: &Image, fine: f64) -> impl Objective {
    let unknowns = image.unknowns.clone();
    let alter = move |point: &Point, sums: &mut NormalEquations| {
        let k = unknowns.len();
        for (i, unknown) in unknowns.iter().enumerate().filter(|(_, unknown)| !unknown.linear()) {
            let off = 2.0 * (unknown.get(point) * fine).sin();
            sums.jtr[i] += OFF * off * (sums.jtj[i * k + i] * sums.residual).sqrt();
        }
    };
    Altered { image: image.clone(), alter }
}

fn fitted(image: &dyn Objective, solver: SolverKind, rough: f64) -> Outcome {
    let tolerances = Tolerances { rough, ..Tolerances::default() };
    let options = FitOptions { solver, tolerances, ..FitOptions::default() };
    fit(image, &point(&[]), &options, &mut |_| {}).unwrap()
}

#[test]
fn a_fit_of_a_rough_loss_ends_where_it_gains_nothing_more() {
    let image = Image::new(4000, &truth()).with_noise(0.02, 5);
    let best = fit(&image, &point(&[]), &FitOptions::default(), &mut |_| {}).unwrap();
    let (mut passes, mut patient) = (0, 0);
    for (solver, fine) in
        [SolverKind::Varpro, SolverKind::Lm].iter().flat_map(|s| [1e7, 2e7, 3e7, 4e7].map(|f| (*s, f)))
    {
        let image = rough(&image, fine);
        let outcome = fitted(&image, solver, Tolerances::default().rough);
        assert_eq!(outcome.ending, Ending::Converged, "{solver:?}");
        // Slopes that are off by up to 2 OFF promise the square of it, times what is due to unknowns that are alike.
        let above = outcome.loss_end / best.loss_end - 1.0;
        assert!(above < 100.0 * OFF * OFF, "{solver:?}: {above:e} above the best");
        passes += outcome.evaluations;
        patient += fitted(&image, solver, 0.0).evaluations;
    }
    println!("{passes} passes, {patient} by patience");
    // Eight fits; without a look back some go on for as long again.
    assert!(passes < patient && passes < 8 * 25, "{passes} passes, {patient} without a look back");
}
