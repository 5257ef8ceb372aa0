//! The losses: from a pixel's model and target values to the weight of its row in the normal
//! equations.

use crate::model::real::Real;
use crate::scene::Loss;
use crate::scene::view::Clip;

/// Huber's threshold, in radiance: residuals beyond it count linearly.
pub const HUBER_THRESHOLD: f64 = 0.05;
/// Added to target^2 by the relative loss: below a tenth of unit radiance errors count absolutely.
pub const RELATIVE_FLOOR: f64 = 0.01;
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
        "const RELATIVE_FLOOR = {RELATIVE_FLOOR:?}f;\nconst HUBER_THRESHOLD = {HUBER_THRESHOLD:?}f;\n\
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
            let floor = model.lit(RELATIVE_FLOOR);
            quadratic(r, weight / target.mul_add(target, floor))
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

#[inline(always)]
fn quadratic<R: Real>(r: R, weight: R) -> Weighted<R> {
    let scale = weight.sqrt();
    let residual = scale * r;
    Weighted { loss: residual * residual, scale, residual }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_carry_the_slope_of_their_loss() {
        for loss in Loss::ALL {
            for target in [0.0_f64, 0.02, 0.7] {
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
