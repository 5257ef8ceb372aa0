//! The loss of images and priors as a function of one layer's texels, and its slope.
//!
//! The loss is the engine's: the mean of weighted squared residuals, where a robust loss is fitted by reweighting.
//! Weights and working targets are taken on the CPU from the very functions that the engine uses.

use burn::tensor::{Tensor, TensorData};

use super::MapError;
use super::layer::Layer;
use crate::engine::residual::weighted_residual;
use crate::engine::view::ObservedView;
use crate::samples::LANES;
use crate::scene::Loss;
use crate::tensor::{Inputs, Shade, SharedDevice, TensorError};

/// Images to be matched, and the layers that may move for it.
pub struct Problem {
    /// The shading operation over all views.
    pub shade: Shade,
    /// What it takes; layers' own inputs follow their values.
    pub inputs: Inputs,
    /// The layers.
    pub layers: Vec<Layer>,
    /// What each pixel slot's image is multiplied with: \[slots, 1\].
    gain: Tensor<2>,
    /// Working targets and their weights (which add up to 1): \[slots, 4\].
    target: Tensor<2>,
    weight: Tensor<2>,
}

/// A view's part in the loss.
pub struct Observed<'a> {
    /// Samples and target.
    pub view: &'a ObservedView,
    /// A factor on its image.
    pub gain: f64,
    /// Whether it counts: a view that is held out does not.
    pub counts: bool,
}

impl Problem {
    /// The problem at the layers' values; [`reweight`](Self::reweight) is to be called before it is solved.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn new(
        shared: &SharedDevice,
        shade: Shade,
        inputs: Inputs,
        layers: Vec<Layer>,
    ) -> Result<Self, TensorError> {
        let device = shared.device();
        let (slots, mut inputs) = (shade.slots(), inputs);
        for layer in &layers {
            layer.show(layer.value.clone(), &mut inputs)?;
        }
        Ok(Self {
            gain: Tensor::ones([slots, 1], device),
            target: Tensor::zeros([slots, 4], device),
            weight: Tensor::zeros([slots, 4], device),
            shade,
            inputs,
            layers,
        })
    }

    /// Take gains, weights and working targets anew, at the present image.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn reweight(
        &mut self,
        shared: &SharedDevice,
        views: &[Observed<'_>],
        loss: Loss,
    ) -> Result<(), TensorError> {
        let image = read(self.shade.image(self.inputs.clone())?)?;
        let (mut gains, mut targets, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let mut total = 0.0;
        for Observed { view, gain, counts } in views {
            let channels = view.target.stride();
            for slot in 0..view.samples.groups() * LANES {
                let pixel = if *counts { f64::from(view.pixel_weight(slot)) } else { 0.0 };
                total += pixel * channels as f64;
                for c in 0..4 {
                    let shown = gain * f64::from(image[4 * gains.len() + c]);
                    let (target, weight) = if c < channels && pixel > 0.0 {
                        let target = f64::from(view.target.number(c, slot));
                        let row = weighted_residual(loss, view.clip, shown, target, pixel);
                        // Where the slope of a robust loss is not its weight times the residual, the target gives way.
                        let residual = if row.scale > 0.0 { row.residual / row.scale } else { 0.0 };
                        (shown - residual, row.scale * row.scale)
                    } else {
                        (0.0, 0.0)
                    };
                    targets.push(target as f32);
                    weights.push(weight);
                }
                gains.push(*gain as f32);
            }
        }
        let weights: Vec<f32> =
            weights.into_iter().map(|w| (w / total.max(f64::MIN_POSITIVE)) as f32).collect();
        let slots = gains.len();
        let matrix = |numbers: Vec<f32>, columns: usize| {
            Tensor::<2>::from_data(TensorData::new(numbers, [slots, columns]), shared.device())
        };
        (self.gain, self.target, self.weight) = (matrix(gains, 1), matrix(targets, 4), matrix(weights, 4));
        Ok(())
    }

    /// The loss, and its slope by the texels of a layer, at `texels`.
    ///
    /// # Errors
    /// When the device does not take it, or the loss is not finite.
    pub fn slope(&self, index: usize, texels: &Tensor<2>) -> Result<(f64, Tensor<2>), MapError> {
        let layer = &self.layers[index];
        let texels = texels.clone().autodiff().require_grad();
        let mut inputs = self.inputs.clone();
        layer.show(texels.clone(), &mut inputs)?;
        let image = self.shade.image(inputs)?;
        let residual = image * self.gain.clone().autodiff() - self.target.clone().autodiff();
        let loss =
            (residual.square() * self.weight.clone().autodiff()).sum() + layer.penalty(texels.clone())?;
        let value = f64::from(read(loss.clone().inner())?[0]);
        let gradients = loss.backward();
        match texels.grad(&gradients) {
            Some(slope) if value.is_finite() => Ok((value, slope)),
            _ => Err(MapError::NotFinite { map: layer.name }),
        }
    }

    /// Give a layer other texels.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn set(&mut self, index: usize, texels: Tensor<2>) -> Result<(), TensorError> {
        self.layers[index].show(texels.clone(), &mut self.inputs)?;
        self.layers[index].value = texels;
        Ok(())
    }
}

/// A tensor's numbers.
///
/// # Errors
/// When the device does not give them.
pub fn read<const D: usize>(tensor: Tensor<D>) -> Result<Vec<f32>, TensorError> {
    let unread = |reason: String| TensorError::Foreign { what: "what is read back", reason };
    let data = tensor.try_into_data().map_err(|error| unread(error.to_string()))?;
    data.try_to_vec::<f32>().map_err(|error| unread(format!("{error:?}")))
}
