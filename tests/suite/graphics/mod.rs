//! The renderer on a graphics adapter, beside the CPU engine.
//!
//! - `bench`: an adapter, scenes, and images of both engines
//! - `parity`: both engines show the same
//! - `accuracy`: what a looser budget and multisampling may change
//! - `constants`: constants that are taken later
//! - `frames`: tiles, sequences, layers
//! - `pictures`: backdrops, bloom, haze
//! - `faults`: what is refused, and lost devices
//! - `vectors`: the conformance vectors through the shader rules; `light_vectors`: those of light
//! - `fused`: the fit engine on the adapter against the plain f64 model
//! - `levels`: levels of the UV atlas that an adapter makes for either
//! - `samples`: samples that the adapter makes, beside the CPU's
//! - `shadow_maps`: what the renderer has in the place of rays to lights
//! - `textures`: maps filtered to the fragment, beside the CPU's samples and many of them
//! - `ways`: both ways of shading with lights on, and what shades forward all the same
//! - `exported`: exported GLSL in place of the renderer's own

mod accuracy;
pub(crate) mod bench;
mod constants;
pub(crate) mod exported;
mod faults;
mod frames;
mod fused;
mod levels;
mod light_vectors;
mod normals;
mod parity;
mod pictures;
pub(crate) mod raw;
mod samples;
mod shadow_maps;
mod stability;
mod textures;
mod vectors;
mod ways;
