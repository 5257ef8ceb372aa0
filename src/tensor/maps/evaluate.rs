//! Points of the functions of maps on the device: what images are made of there as tensors, and the gradients by it,
//! added up over the parts of the samples.

use burn::tensor::{Tensor, TensorData};

use super::MapError;
use super::fit::{column_tensor, cube_tensor};
use super::function::MapGradients;
use super::layer::Layer;
use super::pixels::Part;
use super::problem::read;
use crate::bake::LobeStack;
use crate::engine::{Point, Unknown};
use crate::model::cube::Cube;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param};
use crate::{Inputs, SharedDevice, TensorError};

/// What images follow.
pub(super) struct Variables {
    pub(super) shared: SharedDevice,
    pub(super) layers: Vec<Layer>,
    /// The free columns, but for the exponent of the specular cube.
    pub(super) columns: Vec<Column>,
    /// What that cube is made of, where its exponent is free.
    pub(super) lobes: Option<LobeStack>,
}

/// A point of them, and the gradients that are added up there.
pub(super) struct Evaluation<'a> {
    of: &'a Variables,
    tensors: Tensors,
    /// How the specular cube moves with its exponent, where that is free.
    lobe_slope: Option<Cube<f32>>,
    /// Of each view.
    gains: Vec<Gain>,
    columns: Option<Tensor<1>>,
    lobe: Option<Tensor<2>>,
    texels: Vec<Option<Tensor<2>>>,
    /// By each view's gain, channel by channel.
    by_gain: Vec<[f64; 4]>,
}

/// A point as tensors.
struct Tensors {
    /// The free columns: \[K\].
    columns: Tensor<1>,
    /// The specular cube at its exponent, where that is free: \[texels with borders, 4\].
    lobe: Option<Tensor<2>>,
    /// Each layer's texels: \[texels, channels\].
    texels: Vec<Tensor<2>>,
}

impl Variables {
    /// Take a point to the device: constants and the gains of `views` views, and maps; the start's for those that are not
    /// given.
    ///
    /// # Errors
    /// When there are other maps, or a map has another length.
    pub(super) fn at(
        &self,
        point: &Point,
        views: usize,
        maps: Vec<Option<Vec<f32>>>,
    ) -> Result<Evaluation<'_>, MapError> {
        MapError::check_length("maps", maps.len(), self.layers.len())?;
        let texels = maps.into_iter().zip(&self.layers).map(|(numbers, layer)| {
            let Some(numbers) = numbers else { return Ok(layer.start.clone()) };
            MapError::check_length(layer.name, numbers.len(), layer.numbers())?;
            Ok(self.matrix(numbers, layer.start.dims()))
        });
        let texels = texels.collect::<Result<_, MapError>>()?;
        let exponent = point.params.scalar(Param::SpecularLobe);
        let (lobe, lobe_slope) = self.lobes.as_ref().map(|stack| stack.at(exponent)).unzip();
        let tensors = Tensors {
            columns: column_tensor(&self.shared, &self.columns, point),
            lobe: lobe.map(|cube| cube_tensor(&self.shared, &cube)),
            texels,
        };
        Ok(Evaluation {
            of: self,
            tensors,
            lobe_slope,
            gains: (0..views).map(|view| point.gains.get(view).copied().unwrap_or_default()).collect(),
            columns: None,
            lobe: None,
            texels: vec![None; self.layers.len()],
            by_gain: vec![[0.0; 4]; views],
        })
    }

    fn matrix(&self, numbers: Vec<f32>, shape: [usize; 2]) -> Tensor<2> {
        Tensor::from_data(TensorData::new(numbers, shape), self.shared.device())
    }
}

impl Evaluation<'_> {
    /// The factor on a view's image.
    pub(super) fn gain(&self, view: usize) -> Gain {
        self.gains[view]
    }

    /// The image of a part, which has that number, without the gain: four numbers a slot.
    ///
    /// # Errors
    /// When the device does not give it.
    pub(super) fn image(&self, index: usize, part: &Part) -> Result<Vec<f32>, TensorError> {
        read(part.shade.image(self.tensors.inputs(index, part, &self.of.layers)?)?)
    }

    /// Add the gradient of a part's image, gain included, times the slopes that `slopes` makes of the image without it.
    ///
    /// # Errors
    /// When the device does not take it.
    pub(super) fn pull(
        &mut self,
        index: usize,
        part: &Part,
        slopes: impl FnOnce(&[f32]) -> Vec<[f64; 4]>,
    ) -> Result<(), TensorError> {
        let tracked = self.tensors.tracked();
        let image = part.shade.image(tracked.inputs(index, part, &self.of.layers)?)?;
        let numbers = read(image.clone().without_autodiff())?;
        let gain = self.gains[part.view].channels();
        let mut adjoint = Vec::with_capacity(numbers.len());
        for (slopes, numbers) in slopes(&numbers).into_iter().zip(numbers.chunks_exact(4)) {
            for c in 0..4 {
                self.by_gain[part.view][c] += slopes[c] * f64::from(numbers[c]);
                adjoint.push((gain[c] * slopes[c]) as f32);
            }
        }
        // Where no map and no constant is read, nothing is tracked.
        if image.is_autodiff() {
            let adjoint = self.of.matrix(adjoint, image.dims()).autodiff();
            self.add(&tracked, &(image * adjoint).sum());
        }
        Ok(())
    }

    fn add(&mut self, tracked: &Tensors, number: &Tensor<1>) {
        let gradients = number.backward();
        plus(&mut self.columns, tracked.columns.grad(&gradients));
        plus(&mut self.lobe, tracked.lobe.as_ref().and_then(|lobe| lobe.grad(&gradients)));
        for (sum, texels) in self.texels.iter_mut().zip(&tracked.texels) {
            plus(sum, texels.grad(&gradients));
        }
    }

    /// What was added up, by the unknowns and by each layer.
    ///
    /// # Errors
    /// When the device does not give it.
    pub(super) fn gradients(self, unknowns: &[Unknown]) -> Result<MapGradients, TensorError> {
        let Self { of, lobe_slope, columns, lobe, texels, by_gain, .. } = self;
        let columns = columns.map_or(Ok(Vec::new()), read)?;
        let exponent = match (lobe, lobe_slope) {
            // Not burn's sum, which adds in the order in which threads come.
            (Some(lobe), Some(slope)) => {
                let pairs = read(lobe)?.into_iter().zip(slope.padded().as_flattened());
                pairs.map(|(a, &b)| f64::from(a) * f64::from(b)).sum()
            }
            _ => 0.0,
        };
        let by_column = |column: &Column| {
            let place = of.columns.iter().position(|other| other == column);
            let slope = place.and_then(|place| columns.get(place));
            slope.map_or(0.0, |&slope| f64::from(slope))
        };
        let constant = |unknown: &Unknown| match unknown {
            Unknown::Gain(view, _) => {
                (0..4).filter(|&c| unknown.is_gain_of(*view, c)).map(|c| by_gain[*view][c]).sum()
            }
            Unknown::Param(column) | Unknown::Own(_, column) => match column.param {
                Param::SpecularLobe => exponent,
                _ => by_column(column),
            },
        };
        let of_layer = |(sum, layer): (Option<Tensor<2>>, &Layer)| {
            sum.map_or_else(|| Ok(vec![0.0; layer.numbers()]), read)
        };
        let found = MapGradients {
            constants: unknowns.iter().map(constant).collect(),
            maps: texels.into_iter().zip(&of.layers).map(of_layer).collect::<Result<_, _>>()?,
        };
        // A backward pass that fails leaves zeros, and the reason there.
        of.shared.gpu().check()?;
        Ok(found)
    }
}

impl Tensors {
    /// The same numbers, for one backward pass.
    fn tracked(&self) -> Self {
        let matrix = |tensor: &Tensor<2>| tensor.clone().autodiff().require_grad();
        Self {
            columns: self.columns.clone().autodiff().require_grad(),
            lobe: self.lobe.as_ref().map(matrix),
            texels: self.texels.iter().map(matrix).collect(),
        }
    }

    /// What the shading operation takes of a part of the samples.
    fn inputs(&self, index: usize, part: &Part, layers: &[Layer]) -> Result<Inputs, TensorError> {
        let mut inputs = Inputs { columns: self.columns.clone(), ..part.inputs.clone() };
        if let Some(lobe) = &self.lobe {
            inputs.lobe = lobe.clone();
        }
        for (layer, texels) in layers.iter().zip(&self.texels) {
            layer.show(index, texels.clone(), &mut inputs)?;
        }
        Ok(inputs)
    }
}

fn plus<const D: usize>(sum: &mut Option<Tensor<D>>, more: Option<Tensor<D>>) {
    *sum = match (sum.take(), more) {
        (Some(sum), Some(more)) => Some(sum + more),
        (sum, more) => sum.or(more),
    };
}
