//! What the rules of the skin model are about: parameters, effects, terms, the numbers of a fragment and of a vertex, and
//! the kinds of numbers that they are computed in. The formulas themselves are the rules' (`shader/rules`).
//!
//! - [`params`]: the one table of parameters; `columns`: which of their channels are free together;
//!   [`bounds`]: what a scene bounds them by; [`shares`]: those that add up to no more than 1
//! - [`readings`]: how the paper is read; [`effects`]: what can be switched on; [`needs`]: what each effect asks for;
//!   [`terms`]: parts of the sum
//! - [`choices`]: which way is taken where there are several; [`diffusion`], [`transmission`]: those of light that scatters
//! - [`fields`]: numbers of vertices that rules read by name
//! - [`registry`]: how tables of parameters, effects, terms and fields grow
//! - [`evaluate`]: what is evaluated; [`dapple`]: where light falls through leaves from; [`key_light`]: where it stands;
//!   [`bearing`]: directions as angles; [`mod@turn`]: how the environment is turned
//! - [`shadow_filter`]: how a renderer finds shadows; [`texture_filter`]: how texture maps are filtered
//! - [`fragment`]: a fragment as samples hold it; [`gain`]: what a view's image is multiplied by
//! - [`vertex`]: morphing, skinning and the frame of a vertex, of which meshes are posed
//! - [`cube`]: cube maps and their seamless bilinear lookup
//! - [`real`]: what is asked of a number (f32, f64, SIMD lanes); [`formats`]: number formats of graphics processors;
//!   [`batch`]: several numbers as one; [`vector`]: three of them

pub mod batch;
pub mod bearing;
pub mod bounds;
pub mod choices;
mod columns;
pub mod cube;
pub mod dapple;
pub mod diffusion;
pub mod effects;
pub mod evaluate;
pub mod fields;
pub mod formats;
pub mod fragment;
pub mod gain;
pub mod key_light;
pub mod needs;
pub mod params;
pub mod readings;
pub mod real;
pub mod registry;
pub mod shadow_filter;
pub mod shares;
pub mod terms;
pub mod texture_filter;
pub mod transmission;
pub mod turn;
pub mod vector;
pub mod vertex;
