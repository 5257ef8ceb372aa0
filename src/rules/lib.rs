//! The skin model as rules: what they are about, their formulas, and what is made of them.
//!
//! - [`model`]: the vocabulary of the rules, after *Skin in the "Dawn" Demo* (GPU Gems, chapter 3): the parameter table,
//!   effects, terms, cubes, kinds of numbers. No files, no meshes, no formulas.
//! - [`shader`]: the formulas as rules in WGSL, and the planner that makes shaders of them.
//! - [`program`]: planned rules as arithmetic on numbers, for the processor.
//! - `minimum_cut`: what both keep of a sample from pass to pass, and what they compute anew.
//! - [`specular`]: the specular BRDFs in f64, their integrals, and the rational functions that the rules take for these.

mod minimum_cut;
pub mod model;
pub mod program;
pub mod shader;
pub mod specular;
