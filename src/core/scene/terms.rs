//! The terms that a scene brings with it: files of shader rules, made known to the planner.

use std::path::Path;

use super::error::{SceneError, read_bytes};
use super::file::{ModelTable, SceneFile, Source};
use crate::model::registry::leaked;
use crate::shader::term::{Term, register};

/// Rules are short; more is another kind of file.
const MOST_BYTES: u64 = 1 << 20;

/// Register the terms that a scene file names, and read no more of it: after that its effects and parameters have
/// names.
///
/// # Errors
/// When the scene file or one of its terms cannot be read.
pub fn register_terms(path: &Path) -> Result<Vec<&'static Term>, SceneError> {
    let source = Source::read(path)?;
    let file: SceneFile = source.parse()?;
    terms(&file.model, path.parent().unwrap_or(Path::new("")))
}

/// The terms of the `[model]` table; paths are relative to `folder`.
pub(super) fn terms(model: &ModelTable, folder: &Path) -> Result<Vec<&'static Term>, SceneError> {
    model.terms.iter().map(|path| read(&folder.join(path))).collect()
}

fn read(path: &Path) -> Result<&'static Term, SceneError> {
    let text = String::from_utf8(read_bytes(path, MOST_BYTES)?)
        .map_err(|_| SceneError::new(path, "is not text in UTF-8", "Name a file of shader rules in WGSL"))?;
    let name = path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
    register(leaked(&name), &text).map_err(|error| {
        let place = format!("line {}", error.line);
        SceneError::new(path, error.problem.to_string(), error.problem.remedy()).at(place)
    })
}
