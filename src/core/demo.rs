//! The built-in scene as ordinary files, with the targets that the model renders at its true
//! constants: what `builtin` makes, taken through the stages.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::builtin::{self, BuiltinError};
use crate::output::{self, OutputError};
use crate::prepare::{Loaded, PrepareError, PrepareOptions};
use crate::program::shading::ShadingError;
use crate::progress;
use crate::render::files::{ImageFileError, ImageOptions, write_exr};
use crate::render::shade::Shader;

/// The built-in scene could not be written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant is the stage's own error")]
pub enum DemoError {
    #[error(transparent)]
    Builtin(#[from] BuiltinError),
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Image(#[from] ImageFileError),
    #[error(transparent)]
    Shading(#[from] ShadingError),
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// The file by which builds are told apart, where it is not the process' own.
static LIBRARY: OnceLock<PathBuf> = OnceLock::new();

/// Have builds be told apart by this file from now on: that of a library, which holds the model where another program has
/// loaded it. The first one stays.
pub fn told_apart_by(library: &Path) {
    let _ = LIBRARY.set(library.to_owned());
}

/// The built-in scene below `folder`, made there with its bakes the first time. Returns its scene file.
///
/// # Errors
/// When it cannot be written.
pub fn built_in_scene(folder: &Path) -> Result<PathBuf, DemoError> {
    kept_scene(folder, Some(folder))
}

/// The built-in scene below `folder`, made if it is not there yet, was damaged, or was made by another build of the
/// program, whose model may have been another. Returns its scene file.
///
/// # Errors
/// When it cannot be written.
pub fn kept_scene(folder: &Path, cache: Option<&Path>) -> Result<PathBuf, DemoError> {
    let folder = folder.join(builtin::version());
    kept(&folder, program().as_deref(), |folder| write_scene(folder, cache).map(drop))?;
    Ok(folder.join("scene.toml"))
}

/// Have `folder` hold what `make` writes of this `program`.
fn kept(
    folder: &Path,
    program: Option<&str>,
    make: impl FnOnce(&Path) -> Result<(), DemoError>,
) -> Result<(), DemoError> {
    // Written last, with the program and a hash of every file: a scene for which it still holds is whole and ours.
    let seal = folder.join("complete");
    let sealed = std::fs::read_to_string(&seal).unwrap_or_default();
    let wanted = || program.map(|program| format!("{program}\n{}", hashes(folder)));
    if wanted().is_some_and(|wanted| wanted == sealed) {
        return Ok(());
    }
    make(folder)?;
    if let Some(text) = wanted() {
        output::write(&seal, text.as_bytes())?;
    }
    Ok(())
}

/// A line for the running program's build: the targets are what all of it makes of the scene, from the model to the
/// libraries. The size and the time of its file tell builds apart, as `make` does it. `None`, so that nothing is
/// taken for its own, where there is no such file to ask.
fn program() -> Option<String> {
    let file = LIBRARY.get().cloned().map_or_else(std::env::current_exe, Ok);
    let file = file.and_then(std::fs::metadata).ok()?;
    let modified = file.modified().ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
    Some(format!("skinfit {}, {} bytes, {}", env!("CARGO_PKG_VERSION"), file.len(), modified.as_nanos()))
}

/// A line for each file below `folder`, but for the seal: its hash and its name, in order.
fn hashes(folder: &Path) -> String {
    let mut lines = Vec::new();
    for folder in [folder.to_owned(), folder.join("targets")] {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_file()
                && !path.ends_with("complete")
                && let Ok(bytes) = std::fs::read(&path)
            {
                lines.push(format!("{} {}\n", blake3::hash(&bytes).to_hex(), entry.file_name().display()));
            }
        }
    }
    lines.sort();
    lines.concat()
}

/// Write the built-in scene and its targets into `folder`. Returns its scene file.
///
/// # Errors
/// When it cannot be written.
pub fn write_scene(folder: &Path, cache: Option<&Path>) -> Result<PathBuf, DemoError> {
    builtin::write(folder)?;
    let scene = folder.join("scene.toml");
    let options = PrepareOptions { cache: cache.map(Path::to_owned), ..PrepareOptions::default() };
    let mut loaded = Loaded::read(&scene, &options)?;
    loaded.scene.params = builtin::true_params();
    let sampled = loaded.bake()?.sample()?;
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params)?;
    let bar = progress::bar("targets", sampled.scene.views.len() as u64);
    for (view, samples) in sampled.scene.views.iter().zip(&sampled.samples) {
        let image = shader.shade(samples, &view.camera, 1.0).image;
        let path = folder.join("targets").join(format!("{}.exr", view.name));
        write_exr(&path, &image, &ImageOptions::default())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_that_is_whole_and_of_this_build_is_kept_and_any_other_is_made_anew() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("targets/front.exr");
        let made_by = |program: Option<&str>| {
            let mut made = false;
            kept(folder.path(), program, |_| {
                made = true;
                Ok(output::write(&target, b"a target")?)
            })
            .unwrap();
            made
        };
        assert!(made_by(Some("one")), "nothing is there yet");
        assert!(!made_by(Some("one")));
        assert!(made_by(Some("another")), "targets of another build's model");
        assert!(!made_by(Some("another")));
        std::fs::write(&target, b"damaged").unwrap();
        assert!(made_by(Some("another")));
        std::fs::remove_file(&target).unwrap();
        assert!(made_by(Some("another")));
        assert!(made_by(None) && made_by(None), "a program that is not known keeps nothing");
        // As builds before this one sealed theirs.
        std::fs::write(folder.path().join("complete"), hashes(folder.path())).unwrap();
        assert!(made_by(Some("another")));
    }

    #[test]
    fn this_build_is_known_and_the_same_each_time() {
        assert!(program().is_some_and(|name| name.starts_with("skinfit ")));
        assert_eq!(program(), program());
    }
}
