//! The model on burn's tensors, beside the CPU model in f64.
//!
//! - `bench`: the shared device, and numbers to try
//! - `device`: one device, no copies; `drawn`: samples that the adapter drew
//! - `matrices`: fixed linear maps
//! - `maps`: fits of whole maps
//! - `gradients`: the shading operation and its adjoint; `lit`: of lights, Fresnel and the sky; `diffused`: of light that
//!   scatters in texels

pub(crate) mod bench;
mod device;
mod diffused;
mod drawn;
mod gradients;
pub(crate) mod lit;
mod maps;
mod matrices;
