//! Points of the functions of maps on the device: what images are made of there as tensors, and the gradients by it,
//! added up over the parts of the samples.

use burn::tensor::{Tensor, TensorData};

use super::MapError;
use super::fit::{column_tensor, cube_tensor};
use super::function::MapGradients;
use super::layer::{Layer, slot};
use super::pixels::Part;
use super::problem::read;
use crate::bake::Illumination;
use crate::bake::stacks::Stack;
use crate::engine::{Point, Unknown};
use crate::model::cube::Cube;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param, Params};
use crate::{Input, Inputs, Levels, SharedDevice, TensorError};

/// What images follow.
pub(super) struct Variables {
    pub(super) shared: SharedDevice,
    pub(super) layers: Vec<Layer>,
    /// The free columns, but for the exponent of the specular cube.
    pub(super) columns: Vec<Column>,
    /// The stacks whose cubes free constants choose.
    pub(super) stacks: Vec<Stack>,
    pub(super) illumination: Illumination,
    /// What makes the levels that samples look up of the UV atlas, and what it takes at the start.
    pub(super) levels: Option<(Levels, Inputs)>,
}

/// A point of them, and the gradients that are added up there.
pub(super) struct Evaluation<'a> {
    of: &'a Variables,
    tensors: Tensors,
    params: Params,
    /// The stacks whose cubes are taken, and how each moves with the place that it is taken at.
    cube_slopes: Vec<(Stack, Cube<f32>)>,
    /// Of each view.
    gains: Vec<Gain>,
    columns: Option<Tensor<1>>,
    cubes: Vec<Option<Tensor<2>>>,
    texels: Vec<Option<Tensor<2>>>,
    /// By each view's gain, channel by channel.
    by_gain: Vec<[f64; 4]>,
}

/// A point as tensors.
struct Tensors {
    /// The free columns: \[K\].
    columns: Tensor<1>,
    /// Each stack's cube at its place: \[texels with borders, 4\].
    cubes: Vec<(Input, Tensor<2>)>,
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
        let chosen = self.stacks.iter().filter_map(|stack| {
            let (cube, slope) = stack.at(&self.illumination, stack.place(&point.params))?;
            Some(((input_of(*stack), cube_tensor(&self.shared, &cube)), (*stack, slope)))
        });
        let (cubes, cube_slopes): (Vec<_>, Vec<_>) = chosen.unzip();
        let tensors = Tensors { columns: column_tensor(&self.shared, &self.columns, point), cubes, texels };
        Ok(Evaluation {
            of: self,
            tensors,
            params: point.params.clone(),
            cubes: vec![None; cube_slopes.len()],
            cube_slopes,
            gains: (0..views).map(|view| point.gains.get(view).copied().unwrap_or_default()).collect(),
            columns: None,
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
        read(part.shade.image(self.tensors.inputs(index, part, self.of)?)?)
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
        let image = part.shade.image(tracked.inputs(index, part, self.of)?)?;
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
        for (sum, (_, cube)) in self.cubes.iter_mut().zip(&tracked.cubes) {
            plus(sum, cube.grad(&gradients));
        }
        for (sum, texels) in self.texels.iter_mut().zip(&tracked.texels) {
            plus(sum, texels.grad(&gradients));
        }
    }

    /// What was added up, by the unknowns and by each layer.
    ///
    /// # Errors
    /// When the device does not give it.
    pub(super) fn gradients(self, unknowns: &[Unknown]) -> Result<MapGradients, TensorError> {
        let Self { of, params, cube_slopes, columns, cubes, texels, by_gain, .. } = self;
        let columns = columns.map_or(Ok(Vec::new()), read)?;
        // By the place that each stack's cube is taken at.
        let by_place = |(cube, (stack, slope)): (Option<Tensor<2>>, (Stack, Cube<f32>))| {
            let Some(cube) = cube else { return Ok((stack.paces(&params), 0.0)) };
            // Not burn's sum, which adds in the order in which threads come.
            let pairs = read(cube)?.into_iter().zip(slope.padded().as_flattened());
            let slope: f64 = pairs.map(|(a, &b)| f64::from(a) * f64::from(b)).sum();
            Ok::<_, TensorError>((stack.paces(&params), slope))
        };
        let by_places: Vec<_> = cubes.into_iter().zip(cube_slopes).map(by_place).collect::<Result<_, _>>()?;
        let by_cubes = |param: Param| -> f64 {
            let of = |(paces, slope): &(Vec<(&str, f64)>, f64)| {
                let own = paces.iter().filter(|(name, _)| *name == param.name());
                own.map(|(_, pace)| slope * pace).sum::<f64>()
            };
            by_places.iter().map(of).sum()
        };
        let by_column = |column: &Column| {
            let place = of.columns.iter().position(|other| other == column);
            let slope = place.and_then(|place| columns.get(place));
            slope.map_or(0.0, |&slope| f64::from(slope)) + by_cubes(column.param)
        };
        let constant = |unknown: &Unknown| match unknown {
            Unknown::Gain(view, _) => {
                (0..4).filter(|&c| unknown.is_gain_of(*view, c)).map(|c| by_gain[*view][c]).sum()
            }
            Unknown::Param(column) | Unknown::Own(_, column) => by_column(column),
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
            cubes: self.cubes.iter().map(|(input, cube)| (*input, matrix(cube))).collect(),
            texels: self.texels.iter().map(matrix).collect(),
        }
    }

    /// What the shading operation takes of a part of the samples.
    fn inputs(&self, index: usize, part: &Part, of: &Variables) -> Result<Inputs, TensorError> {
        let mut inputs = Inputs { columns: self.columns.clone(), ..part.inputs.clone() };
        self.cubes.iter().for_each(|(input, cube)| *slot(*input, &mut inputs) = cube.clone());
        for (layer, texels) in of.layers.iter().zip(&self.texels) {
            layer.show(index, texels.clone(), &mut inputs)?;
        }
        if let Some((levels, start)) = &of.levels {
            let mut own = Inputs { columns: self.columns.clone(), ..start.clone() };
            for (layer, texels) in of.layers.iter().zip(&self.texels) {
                layer.show_atlas(texels.clone(), &mut own)?;
            }
            inputs.levels = levels.make(own)?;
        }
        Ok(inputs)
    }
}

/// Which input a stack's cube is.
pub(super) const fn input_of(stack: Stack) -> Input {
    match stack {
        Stack::Specular => Input::Lobe,
        Stack::Reflected => Input::Reflected,
        Stack::Glossy => Input::Glossy,
    }
}

fn plus<const D: usize>(sum: &mut Option<Tensor<D>>, more: Option<Tensor<D>>) {
    *sum = match (sum.take(), more) {
        (Some(sum), Some(more)) => Some(sum + more),
        (sum, more) => sum.or(more),
    };
}
