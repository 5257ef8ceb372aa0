//! The losses: from a pixel's model and target values to the weight of its row in the normal
//! equations.

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

/// The loss as WGSL: `weighted_residual(shown, observed, weight)`, and the constants that it names. Both engines' passes
/// are made from it.
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

/// The residual as the normal equations see it, of a pixel with weight `weight` (not yet the loss').
#[inline(always)]
pub fn weighted_residual<R: Real>(
    loss: Loss,
    clip: Option<Clip>,
    model: R,
    target: R,
    weight: R,
) -> Weighted<R> {
    let (zero, one) = (model.lit(0.0), model.lit(1.0));
    let r = model - target;
    let weight = match clip {
        None => weight,
        // A clipped target only says "at least" or "at most" (MODEL 7).
        Some(clip) => {
            let low = R::and(model.lit(f64::from(clip.low)).ge(target), zero.ge(r));
            let high = R::and(target.ge(model.lit(f64::from(clip.high))), r.ge(zero));
            R::select(low, zero, R::select(high, zero, weight))
        }
    };
    match loss {
        Loss::L2 => quadratic(r, weight),
        Loss::RelativeL2 => {
            let share = one / (lit_part(model) + model.lit(RELATIVE_FLOOR));
            let scale = weight.sqrt() * share;
            Weighted { loss: weight * relative_deviance(model, target), scale, residual: scale * r }
        }
        Loss::Huber => {
            let threshold = model.lit(HUBER_THRESHOLD);
            let size = r.abs();
            let inside = threshold.ge(size);
            let reweight = R::select(inside, one, threshold / size.max(threshold));
            let beyond = threshold * (size + size - threshold);
            let scale = (weight * reweight).sqrt();
            Weighted { loss: weight * R::select(inside, r * r, beyond), scale, residual: scale * r }
        }
        Loss::Smape => {
            let corner = model.lit(SMAPE_CORNER);
            let size = r.abs();
            let inverse = one / (model.abs() + target.abs() + model.lit(SMAPE_FLOOR));
            // |r| is rounded off below the corner: r^2 / (2 corner) + corner / 2.
            let inside = corner.ge(size);
            let half = model.lit(0.5);
            let rounded = R::select(inside, half * (r * r / corner + corner), size);
            let value = rounded * inverse;
            let reweight = half * inverse / size.max(corner);
            let scale = (weight * reweight).sqrt();
            // d/dm (|r| / D) = sign(r) / D - |r| sign(m) / D^2, as a multiple of the reweight. Where both have a
            // sign, 1 - |r| / D is written as what is left of D, for a bright model would cancel in it.
            let with_sign = |x: R| R::select(model.ge(zero), x, -x);
            let one_side = R::select((model * target).ge(zero), model.abs().min(target.abs()), zero);
            let left = (one_side + one_side + model.lit(SMAPE_FLOOR)) * inverse;
            let beyond = r * R::select(with_sign(r).ge(zero), left, one + size * inverse);
            let slope = R::select(corner.ge(size), r - with_sign(value * corner), beyond);
            Weighted { loss: weight * value, scale, residual: scale * slope }
        }
    }
}

/// max(x, 0), of NaN NaN.
#[inline(always)]
fn lit_part<R: Real>(x: R) -> R {
    let zero = x.lit(0.0);
    R::select(x.lt(zero), zero, x)
}

/// Below this share of the sum of two numbers their difference is small.
const SMALL_SHARE: f64 = 0.25;

/// The relative loss of a pixel: `2 int_t^m (x - t) / (max(x, 0) + e)^2 dx`, with e = [`RELATIVE_FLOOR`].
///
/// Dividing the squared residual by the *target* favours pixels that noise made darker; dividing it by the model's own
/// value, moved along with it, favours models that are too bright. A quasi-likelihood does neither (Wedderburn 1974,
/// *Quasi-likelihood functions, generalized linear models, and the Gauss-Newton method*, Biometrika 61): each step is of
/// least squares with the weight `1 / (m + e)^2` held at the model's value, so that `sum(weight J (m - t))` has a mean of 0
/// at the truth whatever the noise, and the loss is the integral whose slope that is. For m and t above 0 it is the
/// deviance of a gamma distribution, `2 (ln(p / q) + q / p - 1)` of p = m + e and q = t + e: near m = t the relative square
/// `(m - t)^2 / (m + e)^2`. Of the variances that grow as the square of the radiance, `(m + e)^2` rather than `m^2 + e^2` is
/// taken as its integral needs no arctangent. Below 0, where only noise and odd constants lead, the weight stays `1 / e^2`.
///
/// With `s = (p - q) / (p + q)` it is `2 s (p - q) / p + 4 (artanh s - s)`: no digit is lost where m is near t.
#[inline(always)]
fn relative_deviance<R: Real>(model: R, target: R) -> R {
    let (zero, one, half) = (model.lit(0.0), model.lit(1.0), model.lit(0.5));
    let floor = model.lit(RELATIVE_FLOOR);
    let (a, b) = (lit_part(model), lit_part(target));
    let (dark_model, dark_target) = (model.min(zero), target.min(zero));
    let (p, q) = (a + floor, b + floor);
    let of_model = (a - b) / p;
    // Halves, so that the sum of huge numbers is finite.
    let share = half * (a - b) / (half * p + half * q);
    let square = share * share;
    // artanh s - s = s^3 / 3 + s^5 / 5 + ...: what is left out is 1e-17 of it at most.
    let mut series = model.lit(1.0 / 27.0);
    for odd in (1..=12).rev() {
        series = series.mul_add(square, model.lit(1.0 / f64::from(2 * odd + 1)));
    }
    let by_log = model.lit(0.5 * std::f64::consts::LN_2) * (p / q).log2() - share;
    let small = model.lit(SMALL_SHARE).ge(share.abs());
    let beyond = R::select(small, series * square * share, by_log);
    let two = one + one;
    let bright = two * (share * of_model + two * beyond) - two * dark_target * of_model / q;
    let inverse = one / floor;
    // In this order no digit is lost where both are dark.
    let slopes = (dark_model - target) + (dark_target - target);
    let below = (dark_model - dark_target) * inverse * (slopes * inverse);
    bright + below
}

#[inline(always)]
fn quadratic<R: Real>(r: R, weight: R) -> Weighted<R> {
    let scale = weight.sqrt();
    let residual = scale * r;
    Weighted { loss: residual * residual, scale, residual }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::evaluate::Shared;
    use crate::program::graph::{Graph, Input};
    use crate::program::lower::{Natives, Source, Value};
    use crate::program::tape::Tape;

    #[test]
    fn rows_carry_the_slope_of_their_loss() {
        for loss in Loss::ALL {
            for target in [-0.05_f64, 0.0, 0.02, 0.7] {
                for model in [-0.1, 0.01, 0.3, 0.69, 0.9, 4.0] {
                    let at = |m: f64| weighted_residual(loss, None, m, target, 0.5);
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
                let double = weighted_residual(Loss::RelativeL2, None, model, target, 1.0).loss;
                let single = weighted_residual(Loss::RelativeL2, None, model as f32, target as f32, 1.0).loss;
                // Simpson's rule to some 1e-12 of the integrals of both signs, which of near numbers nearly cancel.
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
                    weighted_residual(Loss::RelativeL2, None, model, target, 1.0);
                assert!(loss >= 0.0 && loss.is_finite(), "{model} {target}: {loss}");
                assert!(scale > 0.0 && residual.is_finite(), "{model} {target}");
                // The square of less is no f32.
                assert!(loss > 0.0 || (model - target).abs() < 1e-18, "{model} {target}: {loss}");
            }
        }
        assert!(weighted_residual(Loss::RelativeL2, None, f32::NAN, 0.3, 1.0).loss.is_nan());
    }

    #[test]
    fn constants_fitted_to_noise_by_the_relative_loss_are_unbiased() {
        // A constant m fitted to t = 0.3 (1 + noise): by weights of the model's own value it is the mean of the targets.
        let targets = [0.21, 0.24, 0.3, 0.33, 0.42];
        let slope = |m: f64| -> f64 {
            let row = |t: f64| weighted_residual(Loss::RelativeL2, None, m, t, 1.0);
            targets.iter().map(|&t| row(t).scale * row(t).residual).sum()
        };
        // Roundings of five terms; a weight by the target has its zero at 0.275.
        assert!(slope(0.3).abs() < 1e-14 && slope(0.275) < -0.5, "{} {}", slope(0.3), slope(0.275));
    }

    #[test]
    fn the_wgsl_of_each_loss_is_its_rust() {
        for loss in Loss::ALL {
            let mut graph = Graph::default();
            let fields =
                ["shown", "observed", "weight"].map(|name| Value::Numbers(vec![graph.field(name, 0)]));
            let source = Source::new(&loss_text(loss), Natives::Called).unwrap();
            let outputs = source.call(&mut graph, "weighted_residual", fields.to_vec()).unwrap();
            let tape = Tape::new(&graph, &outputs);
            let shared = Shared { uniforms: tape.uniform_values(|_| 0.0), cubes: Vec::new() };
            let numbers = [-2.0, -0.07, 0.0, 3e-5, 0.09, 0.3, 0.301, 0.5, 7.0, 400.0];
            for (model, target) in numbers.iter().flat_map(|&m| numbers.map(|t| (m, t))) {
                let want = weighted_residual(loss, None, model, target, 0.4);
                let field = |input: &Input| match input.name.as_str() {
                    "shown" => model,
                    "observed" => target,
                    _ => 0.4,
                };
                let got = tape.run(&shared, 0.0_f64, field);
                for (got, want) in got.into_iter().zip([want.loss, want.scale, want.residual]) {
                    // Its numbers are decimals of f32, and a series ends where f32 does.
                    let near = 2e-7 * want.abs() + 1e-15;
                    assert!((got - want).abs() <= near, "{loss:?} {model} {target}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn clipped_targets_ask_for_nothing_beyond_the_clip() {
        let clip = Some(Clip { low: 0.001, high: 0.99 });
        for loss in Loss::ALL {
            let size = |model: f64, target: f64| weighted_residual(loss, clip, model, target, 1.0).loss;
            assert_eq!(size(3.0, 1.0), 0.0);
            assert_eq!(size(-0.5, 0.0), 0.0);
            assert!(size(0.5, 1.0) > 0.0 && size(0.5, 0.0) > 0.0 && size(0.5, 0.6) > 0.0);
        }
    }
}
