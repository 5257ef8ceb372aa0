//! The shading model as an operation of burn's autodiff: parameters, maps' values and cubes in, an image out.

use std::sync::Arc;

use burn::tensor::{Tensor, TensorData};

use super::drawn::Planes;
use super::inputs::{Input, Inputs};
use super::levels::{Levels, MadeLevels, lookups};
use super::operation::{self, Operation};
use super::shaded::{Scatter, Shaded};
use super::sparse::Sparse;
use super::stage::{CUBES, Stage};
use super::{SharedDevice, TensorError};
use crate::bake::Illumination;
use crate::bake::stacks::Stack;
use crate::gpu::engine::DeviceSamples;
use crate::model::cube::Cube;
use crate::model::fragment::Fragment;
use crate::samples::ViewSamples;

/// The shading model over the samples of some views; it is cheap to clone.
#[derive(Clone, Debug)]
pub struct Shade {
    stage: Arc<dyn Operation>,
    slots: usize,
    samples: usize,
    texels: Option<Texels>,
}

/// What samples look up of the UV atlas.
#[derive(Clone, Debug)]
struct Texels {
    /// With the inputs to start from.
    levels: (Levels, Inputs),
    /// From the texels that the mesh covers to samples.
    lookups: Sparse,
}

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
        let levels = Levels::of_views(shared, shaded, views, scatter)?;
        Self::build(shared, shaded, views, (None, levels.as_ref()), scatter)
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
        Self::build(shared, shaded, views, (Some(samples), None), scatter)
    }

    /// Of samples that the adapter has made or that `views` hold, which look up those levels.
    pub(super) fn build(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        views: &[&ViewSamples],
        (made, levels): (Option<&DeviceSamples>, Option<&MadeLevels>),
        scatter: Scatter,
    ) -> Result<(Self, Inputs), TensorError> {
        let cubes = Cubes::new(shaded);
        let (stage, drawn) = Stage::new(shared, shaded, cubes.each(), views, made, scatter)?;
        let reads_levels = stage.adjoint.reads(Input::Levels);
        let texels = match levels.filter(|_| reads_levels) {
            Some(MadeLevels { levels, inputs, .. }) => {
                let lookups = Sparse::new(shared, &lookups(levels.atlas(), views, shaded.setup)?)?;
                Some(Texels { levels: (levels.clone(), inputs.clone()), lookups })
            }
            None if reads_levels => return Err(TensorError::no_atlas(shaded.setup.effects)),
            None => None,
        };
        let mut inputs = inputs(shared, &stage, cubes.each(), views, drawn.as_ref());
        inputs.columns = columns(shared, shaded);
        if let Some(made) = levels.filter(|_| reads_levels) {
            inputs.levels = made.start.clone();
        }
        let (slots, samples) = (stage.slots, stage.samples);
        Ok((Self { stage: Arc::new(stage), slots, samples, texels }, inputs))
    }

    /// Pixel slots of the image: 16 for each group of each view, one view after the other.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// Samples, padding included.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Whether the enabled effects read an input.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        self.stage.reads(input)
    }

    /// What makes the levels that samples look up of the UV atlas, and what to start it from; `None` where nothing is computed
    /// in texels.
    #[must_use]
    pub fn levels(&self) -> Option<&(Levels, Inputs)> {
        self.texels.as_ref().map(|texels| &texels.levels)
    }

    /// The image, \[slots, 4\]: radiance (linear Rec.709, the mean over a pixel's samples) and haze of each pixel slot;
    /// 0 where a slot is padding. It is differentiable in whatever input is tracked, once.
    ///
    /// Levels are such an input: what columns and maps do to the image through the UV atlas is in it where they are made of
    /// the same columns and maps ([`Self::levels`]), and else stays as it was made.
    ///
    /// # Errors
    /// When an input that the effects read has another shape, or is not on the device; when one is tracked that has no derivative.
    pub fn image(&self, mut inputs: Inputs) -> Result<Tensor<2>, TensorError> {
        if let Some(texels) = &self.texels {
            inputs.levels = texels.lookups.apply(inputs.levels)?;
        }
        operation::run(&self.stage, inputs)
    }
}

/// The cubes of an illumination, where the parameters have them, in the order of [`CUBES`].
pub(super) struct Cubes<'a> {
    light: &'a Illumination,
    stacks: [Option<Cube<f32>>; 3],
}

impl<'a> Cubes<'a> {
    pub(super) fn new(shaded: &Shaded<'a>) -> Self {
        let light = shaded.illumination;
        let at = |stack: Stack| stack.at(light, stack.place(shaded.params)).map(|(cube, _)| cube);
        Self { light, stacks: Stack::ALL.map(at) }
    }

    pub(super) fn each(&self) -> [Option<&Cube<f32>>; CUBES.len()] {
        let [specular, reflected, glossy] = self.stacks.each_ref().map(Option::as_ref);
        [self.light.irradiance.as_ref(), specular, self.light.hilite.as_ref(), reflected, glossy]
    }
}

/// The free columns at the start.
pub(super) fn columns(shared: &SharedDevice, shaded: &Shaded<'_>) -> Tensor<1> {
    let columns: Vec<f32> = shaded.columns.iter().map(|column| column.get(shaded.params) as f32).collect();
    Tensor::from_data(TensorData::new(columns, [shaded.columns.len()]), shared.device())
}

pub(super) fn matrix(shared: &SharedDevice, numbers: Vec<f32>, shape: [usize; 2]) -> Tensor<2> {
    Tensor::from_data(TensorData::new(numbers, shape), shared.device())
}

/// What nothing reads.
pub(super) fn nothing(shared: &SharedDevice) -> Tensor<2> {
    matrix(shared, vec![0.0], [1, 1])
}

/// A cube's texels with their border.
fn cube(shared: &SharedDevice, cube: Option<&Cube<f32>>) -> Tensor<2> {
    let Some(cube) = cube else { return nothing(shared) };
    matrix(shared, cube.padded().as_flattened().to_vec(), [cube.padded().len(), 4])
}

/// The inputs' tensors, as the samples and cubes have them.
fn inputs(
    shared: &SharedDevice,
    stage: &Stage,
    cubes: [Option<&Cube<f32>>; CUBES.len()],
    views: &[&ViewSamples],
    drawn: Option<&Planes>,
) -> Inputs {
    let planes = |input: Input, of: fn(&Fragment<f32>) -> &[f32]| {
        if !stage.adjoint.reads(input) {
            return nothing(shared);
        }
        if let Some(tensor) = drawn.and_then(|drawn| drawn.tensor(input)) {
            return tensor;
        }
        let width = input.width().unwrap_or(1);
        let mut numbers = Vec::with_capacity(width * stage.samples);
        for view in views {
            (0..view.surface.slots()).for_each(|slot| numbers.extend(of(&view.surface.fragment(slot))));
        }
        matrix(shared, numbers, [stage.samples, width])
    };
    Inputs {
        albedo: planes(Input::Albedo, |at| &at.albedo),
        specular: planes(Input::Specular, |at| std::slice::from_ref(&at.specular)),
        attenuator: planes(Input::Attenuator, |at| std::slice::from_ref(&at.attenuator)),
        open: planes(Input::Open, |at| std::slice::from_ref(&at.occlusion)),
        bump: planes(Input::Bump, |at| &at.bump),
        ..of_cubes(shared, cubes)
    }
}

/// Inputs of these cubes and of nothing else.
pub(super) fn of_cubes(shared: &SharedDevice, cubes: [Option<&Cube<f32>>; CUBES.len()]) -> Inputs {
    let [irradiance, lobe, hilite, reflected, glossy] = cubes.map(|of| cube(shared, of));
    Inputs {
        columns: Tensor::zeros([1], shared.device()),
        albedo: nothing(shared),
        specular: nothing(shared),
        attenuator: nothing(shared),
        open: nothing(shared),
        bump: nothing(shared),
        irradiance,
        lobe,
        hilite,
        reflected,
        glossy,
        levels: nothing(shared),
    }
}
