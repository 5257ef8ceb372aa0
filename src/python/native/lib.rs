//! The library that Python loads as `skinfit._native`: the command line's own calls, with arrays and exceptions. What
//! people call is Python (`package/skinfit`) over it.
//!
//! - `scene`: a scene with the values that one edits; `params`: these
//! - `paint`: a view as an image; `objective`: loss, gradient and Jacobian products; `fitting`: a fit, step by step,
//!   as it is `asked` for
//! - `maps`: the same with respect to whole maps, on the adapter's tensors (`tensors`; `absent` where the library is built
//!   without); `free`: what is free in either
//! - `words`: the command line's words as Python has them; `fault`: panics on purpose
//! - `waiting`: long work beside Python, which goes on meanwhile and hears Ctrl-C
//! - `arrays`: images as arrays and as files; `errors`: what is raised; `program`: the command line

mod arrays;
mod asked;
mod errors;
mod fault;
mod fitting;
mod free;
mod maps;
mod objective;
mod paint;
mod params;
mod program;
mod scene;
#[cfg_attr(not(feature = "burn"), path = "absent.rs")]
mod tensors;
mod waiting;
mod words;

use pyo3::pymodule;

/// What `skinfit` is made of.
#[pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::arrays::write_exr;
    #[pymodule_export]
    use crate::fault::provoke;
    #[pymodule_export]
    use crate::fitting::Fitting;
    #[pymodule_export]
    use crate::free::Constants;
    #[pymodule_export]
    use crate::maps::MapObjective;
    #[pymodule_export]
    use crate::objective::Objective;
    #[pymodule_export]
    use crate::program::{built_in_scene, default_cache, loaded_from, run_program, version};
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::words::in_python;

    /// Know the effects that come with the program, as its command line does.
    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        skinfit_core::shader::term::library::register_all();
        Ok(())
    }
}
