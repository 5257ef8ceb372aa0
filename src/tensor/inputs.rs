//! What operations take: a tensor for each thing that may move.

use burn::backend::wgpu::{CubeBackend, CubeTensor};
use burn::backend::{Autodiff, tensor::FloatTensor};
use burn::tensor::Tensor;

use super::TensorError;
use super::buffer::{plain, tracked};

pub use crate::adjoint::{INPUTS, Input};

/// What the shading operation takes, on the shared device. What the enabled effects do not read is not looked at, and
/// may have any shape. [`Levels`](crate::Levels) take the same of the texels of the UV atlas, in the place of N samples the T
/// that the mesh covers.
///
/// Samples stand in the order of the views' [`ViewSamples`](crate::samples::ViewSamples), one view after the other:
/// `record * 16 + lane`. There are N of them, padding among them.
#[derive(Clone, Debug)]
pub struct Inputs {
    /// The free columns of the model's parameters, in the operation's order: \[K\].
    pub columns: Tensor<1>,
    /// Albedo, linear Rec.709: \[N, 3\].
    pub albedo: Tensor<2>,
    /// Specular map s: \[N, 1\].
    pub specular: Tensor<2>,
    /// Attenuator map a: \[N, 1\].
    pub attenuator: Tensor<2>,
    /// Open share of the hemisphere, S.x: \[N, 1\].
    pub open: Tensor<2>,
    /// The normal map's x T + y B in the world, which `normal_strength` scales: \[N, 3\].
    pub bump: Tensor<2>,
    /// E_d with a border of one texel ([`padding`](crate::model::cube::padding)): \[6 (size + 2)^2, 4\], RGBA.
    pub irradiance: Tensor<2>,
    /// E_s, likewise.
    pub lobe: Tensor<2>,
    /// E_h, likewise.
    pub hilite: Tensor<2>,
    /// E_r where the specular map is black, likewise.
    pub reflected: Tensor<2>,
    /// E_r where it is white, likewise.
    pub glossy: Tensor<2>,
    /// Of a scene whose light stands in its UV atlas, what samples look up there: \[T, W\], W numbers of each covered texel, as
    /// [`Levels::make`](crate::Levels::make) makes them. They are those of the columns, maps and cubes that they were made
    /// with.
    pub levels: Tensor<2>,
}

/// A tensor of the tracked backend.
pub(super) type TrackedTensor = FloatTensor<Autodiff<CubeBackend>>;

impl Inputs {
    /// Those that are tracked.
    pub(super) fn all_tracked(&self) -> Vec<Input> {
        let Self { columns, albedo, specular, attenuator, open, bump, .. } = self;
        let Self { irradiance, lobe, hilite, reflected, glossy, levels, .. } = self;
        let of_samples = [albedo, specular, attenuator, open, bump];
        let matrices = of_samples.into_iter().chain([irradiance, lobe, hilite, reflected, glossy, levels]);
        let tracked = [columns.is_autodiff()].into_iter().chain(matrices.map(Tensor::is_autodiff));
        Input::ALL.into_iter().zip(tracked).filter(|(_, tracked)| *tracked).map(|(input, _)| input).collect()
    }

    /// Their primitives in the order of [`Input::ALL`], cut from any graph.
    pub(super) fn plain(self) -> Result<[CubeTensor; INPUTS], TensorError> {
        let name = |input: Input| input.name();
        Ok([
            plain(name(Input::Columns), self.columns)?,
            plain(name(Input::Albedo), self.albedo)?,
            plain(name(Input::Specular), self.specular)?,
            plain(name(Input::Attenuator), self.attenuator)?,
            plain(name(Input::Open), self.open)?,
            plain(name(Input::Bump), self.bump)?,
            plain(name(Input::Irradiance), self.irradiance)?,
            plain(name(Input::Lobe), self.lobe)?,
            plain(name(Input::Hilite), self.hilite)?,
            plain(name(Input::Reflected), self.reflected)?,
            plain(name(Input::Glossy), self.glossy)?,
            plain(name(Input::Levels), self.levels)?,
        ])
    }

    /// Their primitives in the order of [`Input::ALL`], with their places in the graph.
    pub(super) fn tracked(self) -> Result<[TrackedTensor; INPUTS], TensorError> {
        let name = |input: Input| input.name();
        Ok([
            tracked(name(Input::Columns), self.columns)?,
            tracked(name(Input::Albedo), self.albedo)?,
            tracked(name(Input::Specular), self.specular)?,
            tracked(name(Input::Attenuator), self.attenuator)?,
            tracked(name(Input::Open), self.open)?,
            tracked(name(Input::Bump), self.bump)?,
            tracked(name(Input::Irradiance), self.irradiance)?,
            tracked(name(Input::Lobe), self.lobe)?,
            tracked(name(Input::Hilite), self.hilite)?,
            tracked(name(Input::Reflected), self.reflected)?,
            tracked(name(Input::Glossy), self.glossy)?,
            tracked(name(Input::Levels), self.levels)?,
        ])
    }
}
