//! The renderer on a graphics adapter, beside the CPU engine.
//!
//! - `bench`: an adapter, scenes, and images of both engines
//! - `parity`: both engines show the same
//! - `accuracy`: what a looser budget and multisampling may change
//! - `frames`: tiles, sequences, layers
//! - `faults`: what is refused, and lost devices
//! - `vectors`: the conformance vectors through the shader rules
//! - `exported`: exported GLSL in place of the renderer's own

mod accuracy;
mod bench;
mod exported;
mod faults;
mod frames;
mod parity;
mod vectors;
