//! The skin model: parameters and effects; and its formulas as the fast kernel runs them, generic over the scalar.
//!
//! - [`real`]: what the model asks of a number (f32, f64, SIMD lanes)
//! - [`formats`]: number formats of graphics processors
//! - [`batch`]: several numbers as one
//! - [`vector`]: the few 3-vector operations that the formulas use
//! - [`params`]: the one table of parameters
//! - [`effects`]: what can be switched on, and what each effect asks for
//! - [`registry`]: how tables of parameters, effects and terms grow
//! - [`rim`]: the silhouette and its power; [`dapple`]: where light falls through leaves from
//! - [`fragment`]: the fragment stage: shading normal and reflection
//! - [`terms`]: the light's terms along them
//! - [`lights`]: what shines on a fragment
//! - [`compose`]: the weighted sum of the terms, and its derivatives
//! - [`evaluate`]: what is evaluated
//! - [`cube`]: cube maps and their seamless bilinear lookup
//! - [`vertex`]: morphing, skinning and the frame of a vertex, and what the eye sees of it

pub mod batch;
pub mod compose;
pub mod cube;
pub mod dapple;
pub mod effects;
pub mod evaluate;
pub mod formats;
pub mod fragment;
pub mod lights;
pub mod params;
pub mod real;
pub mod registry;
pub mod rim;
pub mod terms;
pub mod vector;
pub mod vertex;
