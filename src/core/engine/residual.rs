//! The losses: from a pixel's model and target values to the weight of its row in the normal
//! equations.

#[rustfmt::skip]
#[path = "loss/printed.rs"]
#[allow(unused_variables, clippy::all, clippy::pedantic, clippy::nursery, reason = "it is printed")]
mod printed;

use crate::model::batch::Batch;
use crate::model::real::Real;
use crate::scene::Loss;
use crate::scene::view::Clip;

/// Huber's threshold, in radiance: residuals beyond it count linearly.
pub const HUBER_THRESHOLD: f64 = 0.05;
/// Added to the model's value by the relative loss: errors count as a share of the radiance and a tenth.
pub const RELATIVE_FLOOR: f64 = 0.1;
/// Added to the denominator of SMAPE.
pub const SMAPE_FLOOR: f64 = 0.01;
/// SMAPE's residuals below this are treated as quadratic, so that their weight stays finite.
pub const SMAPE_CORNER: f64 = 1e-4;
/// Below this share of the sum of two numbers their difference is small: the relative loss takes a series there.
const SMALL_SHARE: f64 = 0.25;

/// The loss as WGSL: `weighted_residual(shown, observed, weight)`, and the constants that it names: the one
/// text of the losses.
#[must_use]
pub fn loss_text(loss: Loss) -> String {
    let function = match loss {
        Loss::L2 => include_str!("loss/l2.wgsl"),
        Loss::RelativeL2 => include_str!("loss/relative_l2.wgsl"),
        Loss::Huber => include_str!("loss/huber.wgsl"),
        Loss::Smape => include_str!("loss/smape.wgsl"),
    };
    format!(
        "const RELATIVE_FLOOR = {RELATIVE_FLOOR:?}f;\nconst RELATIVE_SMALL_SHARE = {SMALL_SHARE:?}f;\n\
         const HUBER_THRESHOLD = {HUBER_THRESHOLD:?}f;\n\
         const SMAPE_FLOOR = {SMAPE_FLOOR:?}f;\nconst SMAPE_CORNER = {SMAPE_CORNER:?}f;\n\n{function}"
    )
}

/// One residual as the normal equations see it.
#[derive(Clone, Copy, Debug)]
pub struct Weighted<R> {
    /// The loss rho(r).
    pub loss: R,
    /// What scales the Jacobian's row: the root of the (re)weight.
    pub scale: R,
    /// What stands for the residual in that row: scale times it is d rho / d model / 2.
    pub residual: R,
}

impl<const N: usize> Weighted<Batch<f64, N>> {
    /// Each of some residuals.
    pub fn each(&self) -> impl Iterator<Item = Weighted<f64>> {
        let Self { loss, scale, residual } = *self;
        (0..N).map(move |k| Weighted { loss: loss.0[k], scale: scale.0[k], residual: residual.0[k] })
    }
}

/// A loss in any kind of number: its WGSL, printed as Rust ([`crate::program::print`]).
///
/// # The relative loss
///
/// It is `2 int_t^m (x - t) / (max(x, 0) + e)^2 dx`, with e = [`RELATIVE_FLOOR`].
///
/// Dividing the squared residual by the *target* favours pixels that noise made darker; dividing it by the model's own
/// value, moved along with it, favours models that are too bright. A quasi-likelihood does neither (Wedderburn 1974,
/// *Quasi-likelihood functions, generalized linear models, and the Gauss-Newton method*, Biometrika 61): each step is of
/// least squares with the weight `1 / (m + e)^2` held at the model's value, so that `sum(weight J (m - t))` has a mean of 0
/// at the truth whatever the noise, and the loss is the integral whose slope that is. For m and t above 0 it is the
/// deviance of a gamma distribution, `2 (ln(p / q) + q / p - 1)` of p = m + e and q = t + e: near m = t the relative square
/// `(m - t)^2 / (m + e)^2`. Of the variances that grow as the square of the radiance, `(m + e)^2` rather than `m^2 +
/// e^2` is taken as its integral needs no arctangent. Below 0, where only noise and odd constants lead, the weight
/// stays `1 / e^2`.
///
/// With `s = (p - q) / (p + q)` it is `2 s (p - q) / p + 4 (artanh s - s)`: no digit is lost where m is near t.
#[derive(Clone, Copy, Debug)]
pub struct Residuals(Loss);

impl Residuals {
    /// Of a loss.
    #[must_use]
    pub const fn new(loss: Loss) -> Self {
        Self(loss)
    }

    /// The residual of a pixel's value, with the weight `weight` (not yet the loss').
    #[inline(always)]
    pub fn weigh<R: Real>(&self, clip: Option<Clip>, model: R, target: R, weight: R) -> Weighted<R> {
        let weight = match clip {
            None => weight,
            Some(clip) => counted(clip, model, target, weight),
        };
        let [loss, scale, residual] = match self.0 {
            Loss::L2 => printed::l2([model, target, weight]),
            Loss::RelativeL2 => printed::relative_l2([model, target, weight]),
            Loss::Huber => printed::huber([model, target, weight]),
            Loss::Smape => printed::smape([model, target, weight]),
        };
        Weighted { loss, scale, residual }
    }
}

/// A clipped target only says "at least" or "at most" (MODEL 7): beyond it nothing counts.
#[inline(always)]
fn counted<R: Real>(clip: Clip, model: R, target: R, weight: R) -> R {
    let [zero, low, high] = [0.0, clip.low, clip.high].map(|x| model.lit(f64::from(x)));
    let below = R::and(low.ge(target), target.ge(model));
    let above = R::and(target.ge(high), model.ge(target));
    R::select(below, zero, R::select(above, zero, weight))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::graph::Graph;
    use crate::program::lower::{Natives, Source, Value};
    use crate::program::print::statements;
    use crate::program::tape::Tape;

    /// The functions of all losses.
    fn all_losses() -> String {
        let mut text = "\
// Printed from the WGSL beside it by a test of `residual`. Do not edit.
//
// Each function takes the model's value, what was observed and the weight; it yields the loss, and what scales the row of
// the value's derivative and stands for the residual in it.

use crate::model::real::{Real, select};
use crate::program::evaluate::unary;
use crate::program::graph::Unary;
"
        .to_owned();
        for loss in Loss::ALL {
            let mut graph = Graph::default();
            let arguments: Vec<Value> =
                ["shown", "observed", "weight"].map(|name| Value::Numbers(vec![graph.field(name, 0)])).into();
            let source = Source::new(&loss_text(loss), Natives::Written).unwrap();
            let outputs = source.call(&mut graph, "weighted_residual", arguments).unwrap();
            let tape = Tape::new(&graph, &outputs);
            // Nothing but constants is the same for all.
            assert!(tape.uniform_values(|_| f64::NAN).iter().all(|x| x.is_finite()));
            let (statements, outputs) = statements(&tape, "    ", |_, _| String::new());
            let order: Vec<&str> = tape.fields.iter().map(|field| field.name.as_str()).collect();
            assert_eq!(order, ["shown", "observed", "weight"]);
            text.push_str(&format!(
                "\n#[inline(always)]\npub(super) fn {}<R: Real>(given: [R; 3]) -> [R; 3] {{\n    let lit = |x: f64| \
                 given[0].lit(x);\n    let samples = |k: usize| given[k];\n{statements}    [{}]\n}}\n",
                loss.name(),
                outputs.join(", ")
            ));
        }
        text
    }

    #[test]
    fn the_printed_losses_are_what_their_wgsl_says() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/engine/loss/printed.rs");
        let text = all_losses();
        if std::env::var_os("SKINFIT_PRINT_PLANS").is_some() {
            std::fs::write(path, &text).unwrap();
        }
        let stale = "a loss has changed since it was printed: docs/building.md says how to print it anew";
        assert!(
            include_str!("loss/printed.rs") == text || std::fs::read_to_string(path).unwrap() == text,
            "{stale}"
        );
    }

    fn weighted_residual<R: Real>(loss: Loss, clip: Option<Clip>, given: [R; 3]) -> Weighted<R> {
        let [model, target, weight] = given;
        Residuals::new(loss).weigh(clip, model, target, weight)
    }

    #[test]
    fn rows_carry_the_slope_of_their_loss() {
        for loss in Loss::ALL {
            for target in [-0.05_f64, 0.0, 0.02, 0.7] {
                for model in [-0.1, 0.01, 0.3, 0.69, 0.9, 4.0] {
                    let at = |m: f64| weighted_residual(loss, None, [m, target, 0.5]);
                    let h = 1e-7;
                    let slope = (at(model + h).loss - at(model - h).loss) / (2.0 * h);
                    let Weighted { scale, residual, .. } = at(model);
                    let got = 2.0 * scale * residual;
                    // Central differences of f64: 1e-16 / 1e-7, relative to losses of up to 1000.
                    assert!(
                        (got - slope).abs() < 1e-6 * (1.0 + slope.abs()),
                        "{loss:?} {target} {model}: {got} {slope}"
                    );
                }
            }
        }
    }

    /// The relative loss by Simpson's rule over the logarithm of x + e, of which its integrand is smooth.
    fn integrated(model: f64, target: f64) -> f64 {
        let e = RELATIVE_FLOOR;
        let part = |from: f64, to: f64, of: &dyn Fn(f64) -> f64| {
            let steps = 20_000;
            let h = (to - from) / f64::from(steps);
            let weight = |k: i32| if k == 0 || k == steps { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
            (0..=steps).map(|k| weight(k) * of(from + f64::from(k) * h)).sum::<f64>() * h / 3.0
        };
        let log = |x: f64| (x.max(0.0) + e).ln();
        let bright = |u: f64| 2.0 * (u.exp() - e - target) / u.exp();
        let dark = |x: f64| 2.0 * (x - target) / (e * e);
        part(log(target), log(model), &bright) + part(target.min(0.0), model.min(0.0), &dark)
    }

    #[test]
    fn the_relative_loss_is_the_integral_of_its_slope_in_both_widths() {
        let numbers = [-0.3, -0.01, 0.0, 1e-4, 0.05, 0.4, 0.41, 0.4001, 3.0, 90.0];
        for target in numbers {
            for model in numbers {
                let want = integrated(model, target);
                let double = weighted_residual(Loss::RelativeL2, None, [model, target, 1.0]).loss;
                let single =
                    weighted_residual(Loss::RelativeL2, None, [model as f32, target as f32, 1.0]).loss;
                // Numbers of the series are decimals of f32, 2e-8 off, and it ends where f32 does: of a twentieth of the
                // loss at most. Simpson's rule to some 1e-12 of integrals of both signs, which of near numbers nearly
                // cancel.
                assert!(
                    (double - want).abs() <= 2e-9 * (want.abs() + 1e-3),
                    "{model} {target}: {double} {want}"
                );
                // Some ten roundings of 6e-8, and those of the two numbers in their difference.
                let rounded = 1.2e-7 * (model.abs() + target.abs()) / (model - target).abs().max(1e-9);
                let near = 1e-6 + 2.0 * rounded;
                assert!(
                    (f64::from(single) - want).abs() <= near * want + 1e-12,
                    "{model} {target}: {single} {want}"
                );
            }
        }
    }

    #[test]
    fn the_relative_loss_is_finite_and_never_negative_of_huge_and_of_near_numbers() {
        let sizes = [0.0_f32, 1e-30, 1e-8, 0.1, 0.100_000_01, 0.3, 1.0, 7e4, 1e15, 1e30];
        // Below 0 it is a square, whose f32 ends at 1e19 times 1e19.
        let signed = |x: f32| [x, -x.min(1e4)];
        for target in sizes.into_iter().flat_map(signed) {
            for model in sizes.into_iter().flat_map(signed) {
                let Weighted { loss, scale, residual } =
                    weighted_residual(Loss::RelativeL2, None, [model, target, 1.0]);
                assert!(loss >= 0.0 && loss.is_finite(), "{model} {target}: {loss}");
                assert!(scale > 0.0 && residual.is_finite(), "{model} {target}");
                // The square of a smaller difference underflows f32.
                assert!(loss > 0.0 || (model - target).abs() < 1e-18, "{model} {target}: {loss}");
            }
        }
        assert!(weighted_residual(Loss::RelativeL2, None, [f32::NAN, 0.3, 1.0]).loss.is_nan());
    }

    #[test]
    fn constants_fitted_to_noise_by_the_relative_loss_are_unbiased() {
        // A constant m fitted to t = 0.3 (1 + noise): by weights of the model's own value it is the mean of the targets.
        let targets = [0.21, 0.24, 0.3, 0.33, 0.42];
        let slope = |m: f64| -> f64 {
            let row = |t: f64| weighted_residual(Loss::RelativeL2, None, [m, t, 1.0]);
            targets.iter().map(|&t| row(t).scale * row(t).residual).sum()
        };
        // Roundings of five terms; a weight by the target has its zero at 0.275.
        assert!(slope(0.3).abs() < 1e-14 && slope(0.275) < -0.5, "{} {}", slope(0.3), slope(0.275));
    }

    #[test]
    fn clipped_targets_ask_for_nothing_beyond_the_clip() {
        let clip = Some(Clip { low: 0.001, high: 0.99 });
        for loss in Loss::ALL {
            let size = |model: f64, target: f64| weighted_residual(loss, clip, [model, target, 1.0]).loss;
            assert_eq!(size(3.0, 1.0), 0.0);
            assert_eq!(size(-0.5, 0.0), 0.0);
            assert!(size(0.5, 1.0) > 0.0 && size(0.5, 0.0) > 0.0 && size(0.5, 0.6) > 0.0);
        }
    }
}
