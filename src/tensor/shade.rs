//! The shading model as an operation of burn's autodiff: parameters, maps' values and cubes in, an image out.

use std::sync::Arc;

use burn::backend::Autodiff;
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::NoCheckpointing;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::wgpu::{CubeBackend, CubeTensor};
use burn::tensor::{Tensor, TensorData};

use super::drawn::Planes;
use super::inputs::{INPUTS, Input, Inputs, TrackedTensor};
use super::shaded::{Scatter, Shaded};
use super::stage::{CUBES, Stage};
use super::{SharedDevice, TensorError};
use crate::bake::stacks::Stack;
use crate::gpu::engine::DeviceSamples;
use crate::model::cube::Cube;
use crate::model::fragment::Fragment;
use crate::samples::ViewSamples;

/// The shading model over the samples of some views; it is cheap to clone.
#[derive(Clone, Debug)]
pub struct Shade(Arc<Stage>);

impl Shade {
    /// The operation over `views`, and inputs to start from: untracked tensors of what the samples, the parameters
    /// and the cubes hold.
    ///
    /// # Errors
    /// When `specular_lobe` is free, or the device does not take the samples.
    pub fn new(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        views: &[&ViewSamples],
        scatter: Scatter,
    ) -> Result<(Self, Inputs), TensorError> {
        Self::build(shared, shaded, views, None, scatter)
    }

    /// As [`Self::new`], over samples that the adapter draws: `views` are the groups that came with them. What the
    /// geometry pass leaves goes to tensors on the device; none of it passes through the host.
    ///
    /// # Errors
    /// As [`Self::new`], and when they were drawn on another device.
    pub fn over_device_samples(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        samples: &DeviceSamples,
        views: &[&ViewSamples],
        scatter: Scatter,
    ) -> Result<(Self, Inputs), TensorError> {
        Self::build(shared, shaded, views, Some(samples), scatter)
    }

    fn build(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        views: &[&ViewSamples],
        made: Option<&DeviceSamples>,
        scatter: Scatter,
    ) -> Result<(Self, Inputs), TensorError> {
        let light = shaded.illumination;
        let at = |stack: Stack| stack.at(light, stack.place(shaded.params)).map(|(cube, _)| cube);
        let [specular, reflected, glossy] = Stack::ALL.map(at);
        let cubes = [
            light.irradiance.as_ref(),
            specular.as_ref(),
            light.hilite.as_ref(),
            reflected.as_ref(),
            glossy.as_ref(),
        ];
        let (stage, drawn) = Stage::new(shared, shaded, cubes, views, made, scatter)?;
        let inputs = inputs(shared, &stage, shaded, cubes, views, drawn.as_ref());
        Ok((Self(Arc::new(stage)), inputs))
    }

    /// Pixel slots of the image: 16 for each group of each view, one view after the other.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.0.slots
    }

    /// Samples, padding included.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.0.samples
    }

    /// Whether the enabled effects read an input.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        self.0.adjoint.reads(input)
    }

    /// The image, \[slots, 4\]: radiance (linear Rec.709, the mean over a pixel's samples) and haze of each pixel slot;
    /// 0 where a slot is padding. It is differentiable in whatever input is tracked, once.
    ///
    /// # Errors
    /// When an input that the effects read has another shape, or is not on the device; when one is tracked that has no derivative.
    pub fn image(&self, inputs: Inputs) -> Result<Tensor<2>, TensorError> {
        let tracked = inputs.all_tracked();
        // A backward pass returns nothing: what it could not do has to be said here.
        tracked.iter().try_for_each(|&input| self.0.adjoint.moves(input))?;
        if tracked.is_empty() {
            let image = self.0.forward(&inputs.plain()?)?;
            return Ok(Tensor::from_primitive::<CubeBackend>(image));
        }
        let inputs = inputs.tracked()?;
        let nodes = inputs.each_ref().map(TrackedTensor::node);
        let prepared = Adjoints.prepare::<NoCheckpointing>(nodes).compute_bound().stateful();
        let inputs = inputs.map(TrackedTensor::into_primitive);
        let image = self.0.forward(&inputs)?;
        let image = match prepared {
            OpsKind::Tracked(ops) => ops.finish((self.clone(), inputs), image),
            OpsKind::UnTracked(ops) => ops.finish(image),
        };
        Ok(Tensor::from_primitive::<Autodiff<CubeBackend>>(image))
    }
}

/// The backward pass.
#[derive(Debug)]
struct Adjoints;

impl Backward<CubeBackend, INPUTS> for Adjoints {
    type State = (Shade, [CubeTensor; INPUTS]);

    fn backward(self, ops: Ops<Self::State, INPUTS>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let adjoint = gradients.consume::<CubeBackend>(&ops.node);
        let (Shade(stage), inputs) = ops.state;
        let nodes = || Input::ALL.into_iter().zip(&ops.parents);
        let tracked = nodes().filter(|(input, node)| node.is_some() && stage.adjoint.reads(*input));
        let wanted: Vec<Input> = tracked.map(|(input, _)| input).collect();
        let shapes = wanted.iter().map(|&input| stage.shape(input));
        let device = adjoint.device.clone();
        let found = stage.backward(&inputs, adjoint, &wanted);
        for (i, (&input, shape)) in wanted.iter().zip(shapes).enumerate() {
            let one = found.as_ref().map(|all| all[i].clone()).map_err(Clone::clone);
            let gradient = super::or_zeros(stage.shared.gpu(), one, shape, &device);
            if let Some((_, Some(node))) = nodes().find(|(of, _)| *of == input) {
                gradients.register::<CubeBackend>(node.id, gradient);
            }
        }
    }
}

/// The inputs' tensors, as the samples and cubes have them.
fn inputs(
    shared: &SharedDevice,
    stage: &Stage,
    shaded: &Shaded<'_>,
    cubes: [Option<&Cube<f32>>; CUBES.len()],
    views: &[&ViewSamples],
    drawn: Option<&Planes>,
) -> Inputs {
    let device = shared.device();
    let matrix = |rows: usize, columns: usize, numbers: Vec<f32>| {
        Tensor::<2>::from_data(TensorData::new(numbers, [rows, columns]), device)
    };
    let planes = |input: Input, of: fn(&Fragment<f32>) -> &[f32]| {
        if !stage.adjoint.reads(input) {
            return matrix(1, 1, vec![0.0]);
        }
        if let Some(tensor) = drawn.and_then(|drawn| drawn.tensor(input)) {
            return tensor;
        }
        let width = input.width().unwrap_or(1);
        let mut numbers = Vec::with_capacity(width * stage.samples);
        for view in views {
            (0..view.surface.slots()).for_each(|slot| numbers.extend(of(&view.surface.fragment(slot))));
        }
        matrix(stage.samples, width, numbers)
    };
    let cube = |cube: Option<&Cube<f32>>| match cube {
        Some(cube) => matrix(cube.padded().len(), 4, cube.padded().as_flattened().to_vec()),
        None => matrix(1, 1, vec![0.0]),
    };
    let columns: Vec<f32> = shaded.columns.iter().map(|column| column.get(shaded.params) as f32).collect();
    Inputs {
        columns: Tensor::from_data(TensorData::new(columns, [shaded.columns.len()]), device),
        albedo: planes(Input::Albedo, |at| &at.albedo),
        specular: planes(Input::Specular, |at| std::slice::from_ref(&at.specular)),
        attenuator: planes(Input::Attenuator, |at| std::slice::from_ref(&at.attenuator)),
        open: planes(Input::Open, |at| std::slice::from_ref(&at.occlusion)),
        bump: planes(Input::Bump, |at| &at.bump),
        irradiance: cube(cubes[0]),
        lobe: cube(cubes[1]),
        hilite: cube(cubes[2]),
        reflected: cube(cubes[3]),
        glossy: cube(cubes[4]),
    }
}
