//! The run folder: one run at a time, nothing left of a run that was refused, and a scene file that
//! still finds its files.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::Refusal;
use super::fitted_scene::{Changes, as_fitted, named_maps};
use crate::output::{self, OutputError};

/// A run folder that no other run writes to. Unless [`keep`](Self::keep) is called, what opening it
/// made goes with it.
pub(super) struct RunFolder {
    path: PathBuf,
    /// Locked for as long as it is open; the operating system lets go when the program ends.
    _lock: File,
    /// What opening it made, innermost first: the lock's file, and folders.
    made: Vec<PathBuf>,
}

const LOCK: &str = ".lock";

impl RunFolder {
    /// Make and lock `output`, or `runs/<name>` after the scene's folder.
    pub(super) fn open(output: Option<&Path>, scene: Option<&Path>) -> Result<Self, Refusal> {
        let path = output.map_or_else(|| default_folder(scene), Path::to_owned);
        let refused = |reason: std::io::Error| OutputError::new(&path, &reason);
        let file = path.join(LOCK);
        let places = std::iter::once(file.as_path()).chain(path.ancestors());
        let made = places.filter(|p| !p.as_os_str().is_empty()).take_while(|p| !p.exists());
        let made = made.map(Path::to_owned).collect();
        std::fs::create_dir_all(&path).map_err(refused)?;
        let lock = File::create(&file).map_err(refused)?;
        match lock.try_lock() {
            Err(std::fs::TryLockError::WouldBlock) => Err(Refusal::new(format!(
                "{}: another run is writing to this folder. Wait for it, or choose another with -o.",
                path.display()
            ))),
            // A file system without locks: two runs at once are then the user's to avoid.
            Ok(()) | Err(std::fs::TryLockError::Error(_)) => Ok(Self { path, _lock: lock, made }),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// From now on the folder stays: there is something in it.
    pub(super) fn keep(&mut self) {
        self.made.clear();
    }

    /// The scene file as it was fitted, comments and all: its paths are made absolute, so that it can
    /// be used from here, and `changes` stand in place of its own words. Returns the maps that it names.
    pub(super) fn write_scene(&self, scene: &Path, changes: Changes<'_>) -> Result<Vec<PathBuf>, Refusal> {
        let refused = |reason: String| {
            Refusal::new(format!(
                "{}: changed while it was fitted: {reason}. Run the fit again.",
                scene.display()
            ))
        };
        let text = std::fs::read_to_string(scene).map_err(|e| refused(e.to_string()))?;
        let absolute = std::path::absolute(scene).map_err(|e| refused(e.to_string()))?;
        let folder = absolute.parent().unwrap_or(Path::new("/"));
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let text = as_fitted(&text, &folder, changes).map_err(|e| refused(e.message().to_owned()))?;
        output::write(&self.path.join("scene.toml"), text.as_bytes())?;
        Ok(named_maps(&text))
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        for place in &self.made {
            // Whatever is in the way is not ours to remove.
            let _ =
                if place.ends_with(LOCK) { std::fs::remove_file(place) } else { std::fs::remove_dir(place) };
        }
    }
}

/// `runs/<the name of the scene's folder>`, or `runs/builtin`.
fn default_folder(scene: Option<&Path>) -> PathBuf {
    let absolute = scene.and_then(|scene| std::path::absolute(scene).ok());
    let name = absolute.as_deref().and_then(Path::parent).and_then(Path::file_name);
    Path::new("runs").join(name.map_or_else(|| "builtin".into(), PathBuf::from))
}
