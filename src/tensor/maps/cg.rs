//! A layer's texels by projected conjugate gradients.
//!
//! For a quadratic loss H is its second derivative, and H d is a difference of two slopes. As all light is positive,
//! H times ones is a diagonal that bounds H from above (the separable surrogate of emission tomography; Erdogan and
//! Fessler 1999): it preconditions the directions, and a step along the slope divided by it never raises the
//! loss, bounds or not. That step is what is fallen back to where a bound spoilt a conjugate one.

use burn::tensor::Tensor;

use super::MapError;
use super::problem::{Problem, largest, read};

/// A direction is forgotten when the slope has grown by more than this.
const MOST_GROWTH: f64 = 1e4;
/// No step changes a texel by more than this.
const MOST_CHANGE: f64 = 1e6;

/// Improve layer `index` by at most `steps` steps, fewer where `stopped` says so; returns the loss before and after.
///
/// # Errors
/// When the device does not take it, or the loss is not finite.
pub fn solve(
    problem: &mut Problem,
    index: usize,
    steps: usize,
    stopped: &dyn Fn() -> bool,
) -> Result<(f64, f64), MapError> {
    let layer = &problem.layers[index];
    let (lower, upper) = (layer.prior.lower as f32, layer.prior.upper as f32);
    let bounded = |x: Tensor<2>| x.clamp(lower, upper);
    let mut x = bounded(layer.value.clone());
    let (first, mut g) = problem.slope(index, &x)?;
    let inverse = inverse_diagonal(problem, index, &x, &g)?;
    let mut f = first;
    let mut last: Option<(Tensor<2>, f64)> = None;
    for _ in 0..steps {
        if stopped() {
            break;
        }
        // Texels at a bound that the slope pushes against stay there.
        let free = free(&x, &g, lower, upper);
        let z = -g.clone() * inverse.clone() * free.clone();
        let descent = -sum(g.clone() * z.clone())?;
        if descent <= 0.0 || !descent.is_finite() {
            break;
        }
        let d = match &last {
            Some((d, before)) if descent <= MOST_GROWTH * before => {
                z.clone() + d.clone() * free * (descent / before)
            }
            _ => z.clone(),
        };
        let step = step(problem, index, &x, &g, &d)?;
        let wanted = x.clone() + d.clone() * step;
        let next = bounded(wanted.clone());
        let cut = sum((next.clone() - wanted).abs())? > 0.0;
        let (mut f_next, mut g_next) = problem.slope(index, &next)?;
        let mut x_next = next;
        last = if cut { None } else { Some((d, descent)) };
        if step == 0.0 || f_next > f {
            x_next = bounded(x.clone() + z);
            (f_next, g_next) = problem.slope(index, &x_next)?;
            last = None;
            // What is left is rounding.
            if f_next >= f {
                break;
            }
        }
        (x, f, g) = (x_next, f_next, g_next);
    }
    problem.set(index, x)?;
    Ok((first, f))
}

/// 1 where a texel may move along minus the slope.
fn free(x: &Tensor<2>, g: &Tensor<2>, lower: f32, upper: f32) -> Tensor<2> {
    let low = x.clone().lower_equal_scalar(lower).bool_and(g.clone().greater_equal_scalar(0.0));
    let high = x.clone().greater_equal_scalar(upper).bool_and(g.clone().lower_equal_scalar(0.0));
    low.bool_or(high).bool_not().float()
}

/// 1 / (H 1 + the diagonal of the smoothness), where that is positive.
fn inverse_diagonal(
    problem: &Problem,
    index: usize,
    x: &Tensor<2>,
    g: &Tensor<2>,
) -> Result<Tensor<2>, MapError> {
    let layer = &problem.layers[index];
    let (_, moved) = problem.slope(index, &(x.clone() + 1.0))?;
    // A texel and its neighbours: 2 on the diagonal for each, 2 again for the rows beside it.
    let rough = layer.neighbours.clone() * (4.0 * layer.roughness());
    let diagonal = (moved - g.clone()).abs() + rough;
    let most = largest(diagonal.clone())?;
    // Texels that next to nothing sees are moved as if a little more did.
    Ok(diagonal.clamp_min((1e-6 * most).max(1e-30)).recip())
}

/// How far to go along d: to the least of the loss; 0 where rounding leaves none to be seen.
fn step(
    problem: &Problem,
    index: usize,
    x: &Tensor<2>,
    g: &Tensor<2>,
    d: &Tensor<2>,
) -> Result<f64, MapError> {
    let longest = largest(d.clone().abs())?;
    if longest < f64::from(f32::MIN_POSITIVE) || !longest.is_finite() {
        return Ok(0.0);
    }
    // As far as texels are from 0, so that the difference of slopes is not rounded away.
    let reach = 0.5 / longest;
    let (_, there) = problem.slope(index, &(x.clone() + d.clone() * reach))?;
    let along = sum(g.clone() * d.clone())?;
    let curvature = sum((there - g.clone()) * d.clone())? / reach;
    let step = if curvature > 0.0 && along < 0.0 { -along / curvature } else { 0.0 };
    Ok(if step * longest <= MOST_CHANGE { step } else { 0.0 })
}

fn sum(tensor: Tensor<2>) -> Result<f64, MapError> {
    Ok(f64::from(read(tensor.sum())?[0]))
}
