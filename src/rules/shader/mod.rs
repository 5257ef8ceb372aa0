//! The shader planner: from what a scene calls for to the WGSL that computes just that.
//!
//! The paper's vertex shaders were generated: a rules file, the character's set-up and what the
//! fragment shader asks for went in, a search gave the cheapest shader. Here both stages are, and what is computed in
//! texels of the UV atlas.
//!
//! - [`facts`]: what a scene calls for, and the accuracy that it allows
//! - [`quantity`]: what shaders compute, bind and read: quantities, [`Resource`]s, [`Constant`]s
//! - `rules/*.wgsl`: the rules, a file each; [`rule`] reads them
//! - [`domain`]: where quantities are computed, and the edges between domains
//! - [`search`]: the cheapest set of rules within the accuracy budget (A*); `graph`: what it searches
//! - [`emit`]: the plan: the chosen rules, and what they read; `calls`: declarations, functions and calls; `module`: its
//!   WGSL, for rasterised fragments, for stored samples, or as a function for other engines; [`visibility_buffer`]: for
//!   compute shaders that shade what the rasteriser found; `vertex_stage`: a vertex stage that is one; `fetches`: what it costs at the least;
//!   `cited`: its citations as its reader finds them
//! - [`atlas`]: passes over the UV atlas, their text and their tangents
//! - [`kept`]: what of stored samples need not be computed anew in each pass
//! - [`term`]: effects, parameters and rules that a file adds
//! - [`probe`]: its rules one by one, for given numbers
//! - [`tangent`]: the rules' derivatives, made from their own text
//!
//! Nothing that the [`Plan`] does not name is uploaded, bound or compiled.

pub mod atlas;
mod bits;
mod calls;
mod cited;
pub mod domain;
pub mod emit;
pub mod facts;
mod fetches;
mod graph;
pub mod kept;
pub mod module;
pub mod probe;
pub mod quantity;
pub mod rule;
pub mod search;
pub mod tangent;
pub mod term;
pub mod vertex_stage;
pub mod visibility_buffer;

pub use cited::cited;
pub use domain::{Domain, Work};
pub use emit::{Plan, Step, plan};
pub use facts::{Budget, Facts, Source};
pub use quantity::{Attribute, Constant, Resource};
pub use search::PlanError;
