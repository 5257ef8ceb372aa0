//! What every other member may ask of the machine.
//!
//! - [`files`]: files read from disk or from memory; [`output`]: written whole or not at all
//! - [`progress`]: who is told how far long work is
//! - [`simd`]: which instruction sets there are, and which of them runs

pub mod files;
pub mod output;
pub mod progress;
pub mod simd;
