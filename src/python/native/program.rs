//! The command line, and what it knows of itself.

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::{PyResult, Python, pyfunction};
use skinfit_core::bake::cache::default_folder;
use skinfit_core::demo::{DemoError, kept_scene, told_apart_by};

use crate::errors::Refused;
use crate::waiting::wait;

/// Run the program on these words, the first of which is its own name; its exit code. The process is the program's from
/// then on: it handles Ctrl-C, and a word that is not understood ends it.
#[pyfunction]
pub(crate) fn run_program(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| skinfit_host::cli::main_of(&words))
}

/// The library's own file: the built-in scene is made anew where that is another than before.
#[pyfunction]
pub(crate) fn loaded_from(file: PathBuf) {
    told_apart_by(&file);
}

/// The built-in scene's file below `folder`, written there the first time.
#[pyfunction]
pub(crate) fn built_in_scene(py: Python<'_>, folder: PathBuf, cache: Option<PathBuf>) -> PyResult<PathBuf> {
    wait(py, move || kept_scene(&folder, cache.as_deref()).map_err(refused))
}

fn refused(error: DemoError) -> Refused {
    match error {
        DemoError::Prepare(error) => error.into(),
        DemoError::Shading(error) => error.into(),
        DemoError::Output(error) => error.into(),
        DemoError::Builtin(_) | DemoError::Image(_) => Refused::Scene(error.to_string()),
    }
}

/// Where bakes are kept unless a folder is named.
#[pyfunction]
pub(crate) fn default_cache() -> PathBuf {
    default_folder()
}

/// The version of the library.
#[pyfunction]
pub(crate) fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
