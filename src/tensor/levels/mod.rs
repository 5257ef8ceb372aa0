//! What is computed in texels of the UV atlas, as an operation on tensors: the light map and its blurs, of which samples look
//! up what they show.
//!
//! - this module: the operation; `lookups`: from texels to samples, a linear map
//! - `stage`: passes forwards, by the shaders of the engine on an adapter; `backward`: the same passes backwards, from levels to
//!   what they are made of, `text` being their modules; `bound`: what either is given

mod backward;
mod bound;
mod lookups;
mod stage;
mod text;

use std::sync::Arc;

use burn::tensor::Tensor;

pub(super) use self::lookups::lookups;
pub(super) use self::stage::HELD;
use self::stage::LevelStage;
use super::inputs::{Input, Inputs};
use super::operation::{self, Operation};
use super::shade::{Cubes, columns, matrix, nothing, of_cubes};
use super::shaded::{Scatter, Shaded};
use super::{SharedDevice, TensorError};
use crate::model::diffusion::{DiffusionChoices, Method, Seams};
use crate::model::evaluate::Setup;
use crate::samples::{Atlas, ViewSamples};

/// The levels of a UV atlas that samples look up, as an operation over what its texels hold; it is cheap to clone.
#[derive(Clone, Debug)]
pub struct Levels {
    operation: Arc<dyn Operation>,
    atlas: Arc<Atlas>,
    numbers: usize,
}

/// Levels beside what they are made of at the start.
#[derive(Clone, Debug)]
pub(super) struct MadeLevels {
    pub(super) levels: Levels,
    pub(super) inputs: Inputs,
    pub(super) start: Tensor<2>,
}

impl Levels {
    /// The operation over an atlas, and inputs to start from: untracked tensors of what its texels, the parameters and the cubes
    /// hold.
    ///
    /// # Errors
    /// When nothing is computed in texels, or adapters do not make it (sums over the surface, seams that are joined); when
    /// `specular_lobe` is free, or the device has no room.
    pub fn new(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        atlas: &Arc<Atlas>,
        scatter: Scatter,
    ) -> Result<(Self, Inputs), TensorError> {
        check(shaded.setup)?;
        let cubes = Cubes::new(shaded);
        let stage = LevelStage::new(shared, shaded, cubes.each(), Arc::clone(atlas), scatter)?;
        let inputs = inputs(shared, &stage, shaded, &cubes);
        let numbers = stage.numbers();
        Ok((Self { operation: Arc::new(stage), atlas: Arc::clone(atlas), numbers }, inputs))
    }

    /// Those that `views` look up in the atlas that they share; `None` where nothing is computed in texels.
    pub(super) fn of_views(
        shared: &SharedDevice,
        shaded: &Shaded<'_>,
        views: &[&ViewSamples],
        scatter: Scatter,
    ) -> Result<Option<MadeLevels>, TensorError> {
        let Some(atlas) = atlas_of(shaded.setup, views)? else { return Ok(None) };
        let (levels, inputs) = Self::new(shared, shaded, atlas, scatter)?;
        let start = levels.make(inputs.clone())?;
        Ok(Some(MadeLevels { levels, inputs, start }))
    }

    /// How many texels the mesh covers: T.
    #[must_use]
    pub fn texels(&self) -> usize {
        self.atlas.covered()
    }

    /// How many numbers samples look up of each: W.
    #[must_use]
    pub const fn numbers(&self) -> usize {
        self.numbers
    }

    /// Whether what is computed in texels reads an input.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        self.operation.reads(input)
    }

    /// The levels, \[T, W\], for [`Inputs::levels`] of [`Shade::image`](crate::Shade::image). They are differentiable in
    /// whatever input is tracked (columns, albedo, specular, attenuator and open share), once; cubes are held.
    ///
    /// # Errors
    /// When an input that is read has another shape, or is not on the device; when a cube is tracked.
    pub fn make(&self, inputs: Inputs) -> Result<Tensor<2>, TensorError> {
        operation::run(&self.operation, inputs)
    }

    pub(super) const fn atlas(&self) -> &Arc<Atlas> {
        &self.atlas
    }
}

/// That tensors make what is computed in texels.
fn check(setup: Setup) -> Result<(), TensorError> {
    let DiffusionChoices { method, seams, .. } = setup.choices.diffusion;
    match (method, seams) {
        (Method::Surface, _) => Err(TensorError::Levels {
            what: "levels by distance over the surface",
            remedy: "Set method = \"separable\" in [diffusion]",
        }),
        (_, Seams::Joined) => Err(TensorError::Levels {
            what: "blurs that go on across seams",
            remedy: "Set seams = \"cut\" in [diffusion]",
        }),
        (Method::Separable, Seams::Cut) => Ok(()),
    }
}

/// The atlas that views look up, which is one for all; `None` where nothing is computed in texels.
///
/// # Errors
/// When there is none, or several, or tensors do not make what is computed there.
pub(super) fn atlas_of<'v>(
    setup: Setup,
    views: &[&'v ViewSamples],
) -> Result<Option<&'v Arc<Atlas>>, TensorError> {
    if !setup.needs().atlas {
        return Ok(None);
    }
    check(setup)?;
    let mut atlases = views.iter().map(|view| view.atlas.as_ref());
    let first = atlases.next().flatten().ok_or_else(|| TensorError::no_atlas(setup.effects))?;
    if atlases.all(|atlas| atlas.is_some_and(|atlas| Arc::ptr_eq(atlas, first))) {
        return Ok(Some(first));
    }
    Err(TensorError::Levels {
        what: "UV atlas for each view, as scenes have whose views show several poses",
        remedy: "Let all views show one pose",
    })
}

/// The inputs' tensors, as the atlas' texels and the cubes have them.
fn inputs(shared: &SharedDevice, stage: &LevelStage, shaded: &Shaded<'_>, cubes: &Cubes<'_>) -> Inputs {
    let texels = |input: Input| match stage.held(input) {
        Some(numbers) => matrix(shared, numbers, [stage.texels(), input.width().unwrap_or(1)]),
        None => nothing(shared),
    };
    Inputs {
        columns: columns(shared, shaded),
        albedo: texels(Input::Albedo),
        specular: texels(Input::Specular),
        attenuator: texels(Input::Attenuator),
        open: texels(Input::Open),
        ..of_cubes(shared, cubes.each())
    }
}
