//! **skinfit**: a differentiable shading-fit tool for real-time skin.
//!
//! The shader is the one of NVIDIA's *Dawn* demo (GPU Gems, chapter 3). A scene holds a mesh, its maps, the light, and
//! views with target images; a fit finds the constants that match the targets best. All of a program that fits the
//! built-in scene, reads a constant with its standard error, renders a view and exports the constants:
//!
//! ```
//! use skinfit::export::{self, Constants, Target};
//! use skinfit::{FitOptions, Observed, PrepareOptions, Shader, built_in_scene, fit, write_exr};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let folder = std::env::temp_dir().join("skinfit-example");
//!     let scene = built_in_scene(&folder)?; // or the path of your own scene file
//!
//!     // Read it, bake its light and occlusion, and sample the visible surface.
//!     let options = PrepareOptions { cache: Some(folder.clone()), ..PrepareOptions::default() };
//!     let observed = Observed::new(&scene, &options)?;
//!     let outcome = fit(&observed.engine()?, &observed.start(), &FitOptions::default(), &mut |_| {})?;
//!
//!     let base = outcome.constant("base_weight").ok_or("base_weight is not free in this scene")?;
//!     println!("base_weight = {:.4}, standard error {:?}", base.value, base.std_error);
//!     assert!((base.value - 0.85).abs() < 1e-5); // the targets' own, but for roundings to 32 bits
//!
//!     let shader = Shader::new(observed.setup(), &observed.illumination, &outcome.end.params)?;
//!     let (scene, samples) = (&observed.scene, &observed.views[0].samples);
//!     let image = shader.shade(samples, &scene.views[0].camera, 1.0).image;
//!     write_exr(&folder.join("front.exr"), &image, &Default::default())?;
//!
//!     let constants = Constants::new(scene.form, scene.effects, &outcome.end.params);
//!     println!("{}", export::constants(Target::Glsl, constants, &Default::default()));
//!     Ok(())
//! }
//! ```
//!
//! | to | |
//! | --- | --- |
//! | read, bake and sample a scene | [`Observed`], by [`PrepareOptions`]; [`prepare`] has the steps to it, [`Loaded`](prepare::Loaded), [`Baked`](prepare::Baked) and [`Sampled`](prepare::Sampled); [`built_in_scene`] writes a scene |
//! | fit it | [`fit`()] with [`FitOptions`] over an [`Objective`](engine::Objective), made of a [`Task`](engine::Task) with its [`Unknown`](engine::Unknown)s: the [`CpuEngine`], or a [`GpuEngine`] on a [`Gpu`] with its [`Memory`](engine::gpu::Memory) |
//! | fit several scenes as one skin | the same over a [`Joint`](engine::joint::Joint) of their engines; [`HeldOut`](prepare::HeldOut) views score a fit |
//! | read what was found | [`Outcome`]; [`Param`] and [`Params`] are the constants by name, in a [`Point`](engine::Point) |
//! | render | [`Shader`] on the CPU, [`Renderer`] of a [`Content`](gpu::upload::Content) with [`RenderOptions`](gpu::RenderOptions) (their [`Antialias`](render::antialias::Antialias), [`Shading`](render::shading::Shading) and [`Budget`](shader::Budget)) on a graphics adapter, seen by a [`Camera`](scene::view::Camera); [`write_exr`] |
//! | take it to another engine | [`export::constants`] of [`Constants`](export::Constants), or [`export::function`], for a [`Target`](export::Target) |
//! | add a [`Term`] of your own | [`register_term`] (its [`Facts`](shader::Facts) say what can be planned, a [`Column`](model::params::Column) what of it is free), or `[model] terms` of a scene file |
//! | differentiate it on burn's tensors | `tensor::Shade` (feature `burn`) |
//! | see how far long work is | [`progress`] |
//!
//! `experiments/library` has runnable programs: a fit, a rendering, a term of one's own, gradients on tensors.
//!
//! Images are linear Rec.709, premultiplied by their coverage; lengths are the scene's own; angles are degrees in
//! files and radians in the library. Library errors say file, place, what is wrong and what to do. The library has no
//! signals, no progress bars and no command line: long work tells [`progress`] how far it is, and the program
//! `skinfit` (feature `host`, on by default) shows it.
//!
//! What a term's file declares, and each of a scene's lights, is known to the process for as long as it runs: a name stands
//! for one text, another text under it is an error, and there may be 1,024 effects in all.
//!
//! What stands here are a few names of the members of the workspace, which follow the data's one way: `skinfit_core`
//! (engine, solvers, images and exports on the CPU, and under their names the modules of what stands before it: model, scenes,
//! bakes, samples), `skinfit_gpu` (the renderer and the engine on an adapter),
//! `skinfit_tensor`, `skinfit_report` (metrics, pictures and pages), `skinfit_study`, and `skinfit_host`, the command
//! line. The types and functions at the root are kept from version to version, and so are those that the table above takes from modules.
//! **Nothing else of the modules is**: they are the members' own, for whoever needs more, as some of the examples do, and
//! change as these do.

pub use skinfit_core::demo::built_in_scene;
pub use skinfit_core::engine::cpu::CpuEngine;
pub use skinfit_core::fit::outcome::Outcome;
pub use skinfit_core::fit::{FitOptions, fit};
pub use skinfit_core::model::params::{Param, Params};
pub use skinfit_core::prepare::{Observed, PrepareOptions};
pub use skinfit_core::progress;
pub use skinfit_core::render::files::write_exr;
pub use skinfit_core::render::shade::Shader;
pub use skinfit_core::shader::term::{Term, register as register_term};
pub use skinfit_gpu::engine::GpuEngine;
pub use skinfit_gpu::{Gpu, Renderer};

// The members' modules under one name: not kept from version to version, but for what the table above names.
#[doc(no_inline)]
pub use skinfit_core::{
    bake, builtin, demo, export, fit, model, output, prepare, program, render, samples, scene, shader, simd,
};
#[doc(no_inline)]
pub use skinfit_gpu as gpu;
#[doc(no_inline)]
pub use skinfit_report as report;
#[cfg(feature = "host")]
#[doc(no_inline)]
pub use skinfit_study as study;
#[cfg(feature = "burn")]
#[doc(no_inline)]
pub use skinfit_tensor::{self as tensor, maps};

/// Loss, gradient and normal equations over samples, on the CPU and on an adapter.
///
/// What the root's table names of it is kept from version to version, the rest is not.
pub mod engine {
    pub use skinfit_core::engine::*;
    pub use skinfit_gpu::engine as gpu;
}
