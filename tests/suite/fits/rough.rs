//! Losses whose slopes say, but for a part, what the loss does, as those of blurs do whose taps fall between texels.

use skinfit::engine::{NormalEquations, Objective, Point, Unknown};
use skinfit::fit::outcome::{Ending, Outcome};
use skinfit::fit::{FitOptions, SolverKind, Tolerances, fit};

use super::image::{Image, point, truth};

/// How far a slope is off, as a share of the most that the residuals and its column allow (Cauchy and Schwarz): about that of
/// a radius on the scanned head.
const OFF: f64 = 2e-3;

/// An image whose slopes along curved unknowns are off, this way and that from place to place.
struct Rough(Image);

impl Objective for Rough {
    fn unknowns(&self) -> &[Unknown] {
        self.0.unknowns()
    }
    fn is_quadratic(&self) -> bool {
        true
    }
    fn normal_equations(&self, point: &Point) -> NormalEquations {
        let mut sums = self.0.normal_equations(point);
        let k = self.unknowns().len();
        let curved = self.unknowns().iter().enumerate().filter(|(_, unknown)| !unknown.linear());
        for (i, unknown) in curved {
            // What is left of a large multiple looks like chance.
            let off = 2.0 * (unknown.get(point) * 1e7).sin();
            sums.jtr[i] += OFF * off * (sums.jtj[i * k + i] * sums.residual).sqrt();
        }
        sums
    }
    fn loss(&self, point: &Point) -> f64 {
        self.0.loss(point)
    }
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        self.normal_equations(point).loss_and_gradient()
    }
}

fn fitted(image: &Rough, solver: SolverKind, rough: f64) -> Outcome {
    let tolerances = Tolerances { rough, ..Tolerances::default() };
    let options = FitOptions { solver, tolerances, ..FitOptions::default() };
    fit(image, &point(&[]), &options, &mut |_| {}).unwrap()
}

#[test]
fn a_fit_of_a_rough_loss_ends_where_it_gains_nothing_more() {
    let image = Image::new(4000, &truth()).with_noise(0.02, 5);
    let best = fit(&image, &point(&[]), &FitOptions::default(), &mut |_| {}).unwrap();
    let image = Rough(image);
    for solver in [SolverKind::Varpro, SolverKind::Lm] {
        let outcome = fitted(&image, solver, Tolerances::default().rough);
        let patient = fitted(&image, solver, 0.0);
        println!("{solver:?}: {} passes, {} by patience", outcome.evaluations, patient.evaluations);
        assert_eq!(outcome.ending, Ending::Converged, "{solver:?}");
        assert!(outcome.evaluations < patient.evaluations, "{solver:?}: no sooner than without looking back");
        assert!(outcome.evaluations < 40, "{solver:?}: {} passes", outcome.evaluations);
        // Slopes that are off by OFF promise the square of it, for each unknown.
        let above = outcome.loss_end / best.loss_end - 1.0;
        assert!(above < 10.0 * OFF * OFF, "{solver:?}: {above:e} above the best");
    }
}
