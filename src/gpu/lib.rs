//! The production renderer: the planned WGSL on a graphics adapter, in one vertex and fragment pass, or in compute
//! shaders over the triangles that the rasteriser finds.
//!
//! - [`adapter`]: which adapters there are, and which one is taken
//! - [`device`]: the device on it, and what went wrong there
//! - [`upload`]: what a plan reads, on the device (`texels`: in the formats that it is read in;
//!   `vertices`: the mesh at rest, its morph targets and bones; `triangles`: in which order)
//! - `constants`: the uniform block
//! - `targets`: what is drawn into, in tiles where an image with its samples is too large for one
//! - `program`: a plan on the device: its `pipeline` (`formats`: what that reads, in wgpu's words), and before it its passes over the UV atlas ([`atlas`])
//! - `visibility_buffer`: a plan that compute shaders evaluate; `compute`: what they are made with
//! - `shadow`: shadow maps: what each light sees first
//! - `plain`: what is not skin, by its own material
//! - `filter`: passes over whole images: `resolve` (samples to pixels) and `bloom`
//! - `geometry`: what is stored of each sample, drawn instead of shaded: the GPU engine's samples
//! - `records`: where the numbers of a stored sample stand on the device
//! - `readback`: images from the device
//! - [`probe`]: rules evaluated for given numbers
//! - [`timing`]: GPU time by pass; [`bandwidth`]: how fast the adapter's memory is
//! - [`renderer`]: all of it: from a scene and a camera to an image; `stage`: the targets of one size, and what is drawn
//!   into them
//! - [`painter`]: the renderer or the CPU engine, behind one interface
//! - [`engine`]: loss, gradient and normal equations over samples
//! - [`error`]: what is refused
//!
//! Semantics are those of `samples` and `model`; images are compared with `render::shade` in the tests.

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{bake, model, prepare, render, samples, scene, shader};

pub mod adapter;
pub mod atlas;
pub mod bandwidth;
mod bloom;
mod compute;
pub(crate) mod constants;
pub mod device;
pub mod engine;
pub mod error;
mod filter;
mod formats;
pub(crate) mod geometry;
pub mod painter;
mod pipeline;
mod plain;
pub mod probe;
mod program;
pub(crate) mod readback;
pub mod records;
pub mod renderer;
mod resolve;
mod shadow;
mod stage;
mod targets;
pub(crate) mod texels;
pub mod timing;
mod triangles;
pub mod upload;
mod vertices;
mod visibility_buffer;

pub use adapter::Choice;
pub use device::Gpu;
pub use error::{GpuError, Oversized};
pub use renderer::{Frame, RenderOptions, Renderer};

/// Most workgroups of a dispatch, along each of its dimensions: WebGPU's limit.
pub const MOST_OF_A_DISPATCH: u32 = 65_535;
