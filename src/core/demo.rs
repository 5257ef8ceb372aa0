//! The built-in scene as ordinary files, with the targets that the model renders at its true
//! constants: what `builtin` makes, taken through the stages.

use std::path::{Path, PathBuf};

use crate::builtin::{self, BuiltinError};
use crate::model::params::Param;
use crate::output::{self, OutputError};
use crate::prepare::{PrepareError, PrepareOptions, Prepared};
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
    Output(#[from] OutputError),
}

/// The built-in scene below `folder`, made if it is not there yet or was damaged. Returns its scene
/// file.
///
/// # Errors
/// When it cannot be written.
pub fn kept_scene(folder: &Path, cache: Option<&Path>) -> Result<PathBuf, DemoError> {
    let folder = folder.join(builtin::version());
    // Written last, with a hash of every file: a scene for which it still holds is whole.
    let seal = folder.join("complete");
    let sealed = std::fs::read_to_string(&seal).unwrap_or_default();
    if !sealed.is_empty() && sealed == hashes(&folder) {
        return Ok(folder.join("scene.toml"));
    }
    let scene = write_scene(&folder, cache)?;
    output::write(&seal, hashes(&folder).as_bytes())?;
    Ok(scene)
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
    let mut prepared = Prepared::new(&scene, &options)?;
    prepared.scene.params = builtin::true_params();
    let lobe = prepared.scene.params.scalar(Param::SpecularLobe);
    prepared.bake(lobe..=lobe, cache)?;
    let shader = Shader::new(prepared.setup(), &prepared.illumination, &prepared.scene.params);
    let bar = progress::bar("targets", prepared.scene.views.len() as u64);
    for (view, samples) in prepared.scene.views.iter().zip(&prepared.samples) {
        let image = shader.shade(samples, &view.camera, 1.0).image;
        let path = folder.join("targets").join(format!("{}.exr", view.name));
        write_exr(&path, &image, &ImageOptions::default())?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(scene)
}
