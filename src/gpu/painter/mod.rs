//! What draws images of a scene: the CPU engine or the production renderer, behind one interface.
//!
//! - `cpu`: rays through the samples' positions, the rules in f64
//! - `gpu`: the [`Renderer`](crate::Renderer)

mod cpu;
mod gpu;

pub use cpu::CpuPainter;
pub use gpu::GpuPainter;

use std::pin::Pin;

use skinfit_core::program::shading::ShadingError;

use super::GpuError;
use crate::bake::PoseBake;
use crate::model::gain::Gain;
use crate::model::params::Params;
use crate::render::image::Image;
use crate::samples::SampleError;
use crate::scene::mesh::Mesh;
use crate::scene::view::Camera;

/// An image could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PaintError {
    /// The adapter's device could not do it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// No rules yield what the effects call for.
    #[error(transparent)]
    Shading(#[from] ShadingError),
    /// The surface cannot be sampled.
    #[error(transparent)]
    Samples(#[from] SampleError),
}

/// What a frame shows.
pub struct Picture {
    /// Radiance, premultiplied by alpha, which is the coverage.
    pub image: Image,
    /// An image for each term and what stands behind the mesh, where layers are requested.
    pub layers: Vec<(String, Image)>,
    /// The haze of each pixel, where it is requested and an effect makes one.
    pub haze: Vec<f32>,
    /// What was brighter than 16-bit formats hold.
    pub cut: Cut,
}

/// What was cut at 65504, the end of the range of 16-bit formats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    /// Texels of the environment's cubes, told with the first image.
    pub texels: usize,
    /// Pixels of the image.
    pub pixels: usize,
}

/// What a picture is to hold beside the image.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// An image for each term, what is not skin and what stands behind the mesh.
    pub layers: bool,
    /// The haze.
    pub haze: bool,
}

/// A picture to come.
pub type Painting<'a> = Pin<Box<dyn Future<Output = Result<Picture, PaintError>> + 'a>>;

/// An engine with a scene in it, which draws wherever it was made.
pub trait Painter {
    /// The engine, in words.
    fn name(&self) -> String;
    /// Move the mesh to another pose, with what is baked of that pose where it has bakes of its own.
    ///
    /// # Errors
    /// When something was baked for another mesh.
    fn set_mesh(&mut self, mesh: &Mesh, own: Option<PoseBake>) -> Result<(), PaintError>;
    /// Take other constants: of the images to come, at the scene's own pose.
    ///
    /// # Errors
    /// When no rules yield the effects' image, or the device does not take what is read at them.
    fn set_params(&mut self, params: &Params) -> Result<(), PaintError>;
    /// Shade `per_axis` samples along a pixel's side in the images to come, where an engine can do with fewer than the
    /// scene's: the CPU engine keeps those that it has found.
    fn set_samples(&mut self, _per_axis: u32) {}
    /// The image that `camera` sees, times `gain`.
    ///
    /// # Errors
    /// When the device fails, or the scene cannot be sampled.
    fn paint(&mut self, camera: &Camera, gain: Gain, beside: Beside) -> Result<Picture, PaintError>;
    /// As [`paint`](Self::paint), without waiting and without times, as a browser wants it.
    fn paint_async<'a>(&'a mut self, camera: &'a Camera, gain: Gain, beside: Beside) -> Painting<'a>;
    /// Bytes of mesh, maps and cubes on the adapter; 0 of the CPU engine.
    fn uploaded_bytes(&self) -> u64 {
        0
    }
    /// What the last frame took, a line each.
    fn stats(&self) -> Vec<String>;
}

/// The layer of what stands behind the mesh.
const BACKGROUND: &str = "background";
