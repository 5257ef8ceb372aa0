//! The front of all that runs on the CPU: engine, solvers, images, exports; and, under their names, the modules of the members
//! before it.
//!
//! Data flows one way through the modules, as `docs/architecture.md` draws it:
//!
//! - [`prepare`]: the stages up to the samples, run once and timed.
//! - [`engine`]: loss, gradient and normal equations over samples.
//! - [`fit`]: the solvers, and what is known of the answer afterwards.
//! - [`render`]: images from samples, and image files.
//! - [`export`]: constants and shaders as text for other engines.
//! - [`demo`]: the built-in scene as files, its targets rendered.
//!
//! What stands before them: the model ([`skinfit_rules`]), scenes ([`skinfit_scene`]), the head that the program makes
//! ([`skinfit_builtin`]), bakes and samples ([`skinfit_sampling`]).

#[doc(no_inline)]
pub use skinfit_base::{files, output, progress, simd, with_simd};
#[doc(no_inline)]
pub use skinfit_builtin as builtin;
#[doc(no_inline)]
pub use skinfit_rules::{model, program, shader, specular};
#[doc(no_inline)]
pub use skinfit_sampling::{bake, samples};
#[doc(no_inline)]
pub use skinfit_scene as scene;

pub mod demo;
pub mod engine;
pub mod export;
pub mod fit;
pub mod prepare;
pub mod render;
