//! The loss of images and priors as a function of one layer's texels, and its slope.
//!
//! The loss is the engine's: the mean of weighted squared residuals, where a robust loss is fitted by reweighting.
//! Weights and working targets are taken on the CPU from the very text that the engine uses.

use burn::tensor::{Tensor, TensorData};

use super::MapError;
use super::layer::{Layer, slot};
use crate::engine::residual::{Residuals, Weighted};
use crate::engine::view::ObservedView;
use crate::model::batch::Batch;
use crate::model::gain::Gain;
use crate::samples::LANES;
use crate::scene::Loss;
use crate::{Input, Inputs, Levels, Shade, SharedDevice, TensorError};

/// Images to be matched, and the layers that may move for it.
pub struct Problem {
    /// The views' pixels, in parts.
    parts: Vec<Part>,
    /// The layers.
    pub layers: Vec<Layer>,
    /// What makes the levels that samples look up of the UV atlas, and what it takes; layers' own inputs follow their values.
    levels: Option<(Levels, Inputs)>,
}

/// Some of the pixels.
struct Part {
    /// The shading operation over them.
    shade: Shade,
    /// What it takes; layers' own inputs follow their values.
    inputs: Inputs,
    /// What each pixel slot's image is multiplied with: \[slots, 4\].
    gain: Tensor<2>,
    /// Working targets and their weights (which add up to 1 over all parts): \[slots, 4\].
    target: Tensor<2>,
    weight: Tensor<2>,
}

/// What a pixel slot of an image shows, times its view's gain.
pub(super) fn shown(image: &[f32], slot: usize, gain: Gain) -> Batch<f64, 4> {
    Batch(std::array::from_fn(|c| gain.channel(c) * f64::from(image[4 * slot + c])))
}

/// The residuals of a view's pixel slot, which counts so much and shows that, as the engine weighs them.
pub(super) fn weighed(
    residuals: Residuals,
    view: &ObservedView,
    (slot, pixel): (usize, f64),
    shown: Batch<f64, 4>,
) -> Weighted<Batch<f64, 4>> {
    residuals.weigh(view.clip, shown, wanted(view, slot), Batch([pixel; 4]))
}

/// The target at a view's slot; 0 in channels that are not compared.
fn wanted(view: &ObservedView, slot: usize) -> Batch<f64, 4> {
    let channel = |c| if c < view.target.stride() { f64::from(view.target.number(c, slot)) } else { 0.0 };
    Batch(std::array::from_fn(channel))
}

/// A view's part in the loss.
pub struct Observed<'a> {
    /// Samples and target.
    pub view: &'a ObservedView,
    /// A factor on its image.
    pub gain: Gain,
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
        parts: Vec<(Shade, Inputs)>,
        layers: Vec<Layer>,
        mut levels: Option<(Levels, Inputs)>,
    ) -> Result<Self, TensorError> {
        if let Some((_, inputs)) = &mut levels {
            layers.iter().try_for_each(|layer| layer.show_atlas(layer.value.clone(), inputs))?;
        }
        let device = shared.device();
        let part = |(index, (shade, mut inputs)): (usize, (Shade, Inputs))| {
            for layer in &layers {
                layer.show(index, layer.value.clone(), &mut inputs)?;
            }
            let slots = shade.slots();
            Ok::<_, TensorError>(Part {
                gain: Tensor::ones([slots, 4], device),
                target: Tensor::zeros([slots, 4], device),
                weight: Tensor::zeros([slots, 4], device),
                shade,
                inputs,
            })
        };
        let parts = parts.into_iter().enumerate().map(part).collect::<Result<_, _>>()?;
        let mut problem = Self { parts, layers, levels };
        problem.make_levels()?;
        Ok(problem)
    }

    /// Whether the images follow an input.
    pub(super) fn reads(&self, input: Input) -> bool {
        let in_texels = self.levels.as_ref().is_some_and(|(levels, _)| levels.reads(input));
        in_texels || self.parts.iter().any(|part| part.shade.reads(input))
    }

    /// Make levels anew.
    fn make_levels(&mut self) -> Result<(), TensorError> {
        if let Some((levels, inputs)) = &self.levels {
            let made = levels.make(inputs.clone())?;
            self.parts.iter_mut().for_each(|part| part.inputs.levels = made.clone());
        }
        Ok(())
    }

    /// Take other constants: the columns of the parameters, and of the cubes that these choose those that no layer is.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn set_constants(
        &mut self,
        columns: &Tensor<1>,
        cubes: &[(Input, Tensor<2>)],
    ) -> Result<(), TensorError> {
        let chosen =
            || cubes.iter().filter(|(input, _)| self.layers.iter().all(|layer| layer.input != *input));
        for part in &mut self.parts {
            part.inputs.columns = columns.clone();
            chosen().for_each(|(input, cube)| *slot(*input, &mut part.inputs) = cube.clone());
        }
        if let Some((_, inputs)) = &mut self.levels {
            inputs.columns = columns.clone();
            chosen().for_each(|(input, cube)| *slot(*input, inputs) = cube.clone());
        }
        self.make_levels()
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
    ) -> Result<(), MapError> {
        let residuals = Residuals::new(loss);
        let image = self.image()?;
        let (mut gains, mut targets, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let mut total = 0.0;
        for Observed { view, gain, counts } in views {
            let channels = view.target.stride();
            for slot in 0..view.samples.groups() * LANES {
                let pixel = if *counts { f64::from(view.pixel_weight(slot)) } else { 0.0 };
                total += pixel * channels as f64;
                let shown = shown(&image, gains.len() / 4, *gain);
                let rows = weighed(residuals, view, (slot, pixel), shown);
                for (c, Weighted { scale, residual, .. }) in rows.each().enumerate() {
                    let (target, weight) = if c < channels && pixel > 0.0 {
                        // Where the slope of a robust loss is not its weight times the residual, the target gives way.
                        let residual = if scale > 0.0 { residual / scale } else { 0.0 };
                        (shown.0[c] - residual, scale * scale)
                    } else {
                        (0.0, 0.0)
                    };
                    targets.push(target as f32);
                    weights.push(weight);
                }
                gains.extend(gain.channels().map(|factor| factor as f32));
            }
        }
        let weights: Vec<f32> =
            weights.into_iter().map(|w| (w / total.max(f64::MIN_POSITIVE)) as f32).collect();
        let mut first = 0;
        for part in &mut self.parts {
            let slots = part.shade.slots();
            let matrix = |numbers: &[f32], columns: usize| {
                let numbers = numbers[first * columns..(first + slots) * columns].to_vec();
                Tensor::<2>::from_data(TensorData::new(numbers, [slots, columns]), shared.device())
            };
            (part.gain, part.target, part.weight) =
                (matrix(&gains, 4), matrix(&targets, 4), matrix(&weights, 4));
            first += slots;
        }
        Ok(())
    }

    /// The image at the layers' values, without gains: four numbers a pixel slot.
    fn image(&self) -> Result<Vec<f32>, TensorError> {
        let mut image = Vec::new();
        for part in &self.parts {
            image.extend(read(part.shade.image(part.inputs.clone())?)?);
        }
        Ok(image)
    }

    /// The images' loss at the layers' values, as the engine has it: what [`slope`](Self::slope) minimises are squares that
    /// stand for it.
    ///
    /// # Errors
    /// When the device does not give the image.
    pub fn loss(&self, views: &[Observed<'_>], loss: Loss) -> Result<f64, MapError> {
        let residuals = Residuals::new(loss);
        let image = self.image()?;
        let (mut sum, mut total, mut first) = (0.0, 0.0, 0);
        for Observed { view, gain, counts } in views {
            let channels = view.target.stride();
            let slots = view.samples.groups() * LANES;
            for slot in (0..slots).filter(|&slot| *counts && view.pixel_weight(slot) > 0.0) {
                let pixel = f64::from(view.pixel_weight(slot));
                total += pixel * channels as f64;
                let shown = shown(&image, first + slot, *gain);
                let rows = weighed(residuals, view, (slot, pixel), shown);
                sum += rows.loss.0[..channels].iter().sum::<f64>();
            }
            first += slots;
        }
        Ok(sum / total.max(f64::MIN_POSITIVE))
    }

    /// The squares that stand for the loss, and their slope by the texels of a layer, at `texels`.
    ///
    /// # Errors
    /// When the device does not take it, or the loss is not finite.
    pub fn slope(&self, index: usize, texels: &Tensor<2>) -> Result<(f64, Tensor<2>), MapError> {
        let layer = &self.layers[index];
        let (mut value, mut slope) = (0.0, None);
        for part in 0..self.parts.len() {
            let texels = texels.clone().autodiff().require_grad();
            let mut loss = self.image_loss(part, layer, texels.clone())?;
            if part == 0 {
                loss = loss + layer.penalty(texels.clone())?;
            }
            value += f64::from(read(loss.clone().inner())?[0]);
            let gradients = loss.backward();
            let one = texels.grad(&gradients).ok_or(MapError::NotFinite { map: layer.name })?;
            slope = Some(match slope {
                None => one,
                Some(sum) => sum + one,
            });
        }
        match slope {
            Some(slope) if value.is_finite() => Ok((value, slope)),
            _ => Err(MapError::NotFinite { map: layer.name }),
        }
    }

    /// A part's share of the images' loss.
    fn image_loss(&self, index: usize, layer: &Layer, texels: Tensor<2>) -> Result<Tensor<1>, TensorError> {
        let part = &self.parts[index];
        let mut inputs = part.inputs.clone();
        if let Some((levels, own)) = self.levels.as_ref().filter(|_| layer.in_atlas.is_some()) {
            let mut own = own.clone();
            layer.show_atlas(texels.clone(), &mut own)?;
            inputs.levels = levels.make(own)?;
        }
        layer.show(index, texels, &mut inputs)?;
        let image = part.shade.image(inputs)?;
        let residual = image * part.gain.clone().autodiff() - part.target.clone().autodiff();
        Ok((residual.square() * part.weight.clone().autodiff()).sum())
    }

    /// What a layer's priors say against its values: their share of the loss.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn prior(&self, index: usize) -> Result<f64, TensorError> {
        let layer = &self.layers[index];
        Ok(f64::from(read(layer.penalty(layer.value.clone())?)?[0]))
    }

    /// Give a layer other texels.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn set(&mut self, index: usize, texels: Tensor<2>) -> Result<(), TensorError> {
        for (part, Part { inputs, .. }) in self.parts.iter_mut().enumerate() {
            self.layers[index].show(part, texels.clone(), inputs)?;
        }
        if let Some((_, inputs)) = &mut self.levels {
            self.layers[index].show_atlas(texels.clone(), inputs)?;
        }
        if self.layers[index].in_atlas.is_some() {
            self.make_levels()?;
        }
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

/// The largest of a tensor's numbers, slice by slice: one reduction of burn's leaves out what is beyond some 262,000
/// numbers on adapters that allow 65,535 workgroups (0.22.1).
///
/// # Errors
/// When the device does not give it.
pub fn largest(tensor: Tensor<2>) -> Result<f64, TensorError> {
    const ROWS: usize = 1 << 16;
    let slices = tensor.max_dim(1).split(ROWS, 0).into_iter().map(Tensor::max).collect();
    Ok(f64::from(read(Tensor::cat(slices, 0).max())?[0]))
}
