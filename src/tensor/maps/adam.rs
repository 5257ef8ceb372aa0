//! A layer's texels by burn's Adam: no use is made of the loss being quadratic.

use burn::module::{Module, Param};
use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::Tensor;

use super::MapError;
use super::problem::Problem;

#[derive(Module, Debug)]
struct Texels {
    texels: Param<Tensor<2>>,
}

/// Improve layer `index` by `steps` steps of length `rate`, fewer where `stopped` says so; returns the loss before and
/// after.
///
/// # Errors
/// When the device does not take it, or the loss is not finite.
pub fn solve(
    problem: &mut Problem,
    index: usize,
    steps: usize,
    rate: f64,
    stopped: &dyn Fn() -> bool,
) -> Result<(f64, f64), MapError> {
    let prior = problem.layers[index].prior;
    let (lower, upper) = (prior.lower as f32, prior.upper as f32);
    let start = problem.layers[index].value.clone().clamp(lower, upper);
    let (first, _) = problem.slope(index, &start)?;
    let mut best = (first, start.clone());
    let mut module = Texels { texels: Param::from_tensor(start.autodiff()) };
    let mut optimiser = AdamConfig::new().init();
    for _ in 0..steps {
        if stopped() {
            break;
        }
        let at = module.texels.val().inner();
        let (loss, slope) = problem.slope(index, &at)?;
        if loss < best.0 {
            best = (loss, at);
        }
        let mut gradients = GradientsParams::new();
        gradients.register(module.texels.id, slope);
        module = optimiser.step(rate, module, gradients);
        module.texels = module.texels.map(|texels| texels.inner().clamp(lower, upper).autodiff());
    }
    let at = module.texels.val().inner();
    let (loss, _) = problem.slope(index, &at)?;
    if loss < best.0 {
        best = (loss, at);
    }
    problem.set(index, best.1)?;
    Ok((first, best.0))
}
