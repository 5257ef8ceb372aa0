//! The run folder: one run of one command at a time, nothing left of a run that was refused, and a scene file that
//! still finds its files. What bakes are written to is locked in the same way.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::fitted_scene::{Changes, as_fitted, named_maps};
use super::{Refusal, unfinished};
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

/// A command that leaves results in a run folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Work {
    Fit,
    Ablation,
    Tradeoff,
    Stability,
    Suggestion,
}

impl Work {
    const ALL: [Self; 5] = [Self::Fit, Self::Ablation, Self::Tradeoff, Self::Stability, Self::Suggestion];

    const fn command(self) -> &'static str {
        match self {
            Self::Fit => "skinfit fit",
            Self::Ablation => "skinfit ablate",
            Self::Tradeoff => "skinfit tradeoff",
            Self::Stability => "skinfit stability",
            Self::Suggestion => "skinfit suggest",
        }
    }

    /// Whether a folder holds results of this command.
    fn left_in(self, folder: &Path) -> bool {
        // Two commands share a name; what is in it tells them apart.
        let results = |key: &str| {
            let text = std::fs::read(folder.join("results.json")).unwrap_or_default();
            serde_json::from_slice::<serde_json::Value>(&text).is_ok_and(|file| file.get(key).is_some())
        };
        match self {
            Self::Fit => ["state.json", "report.json"].iter().any(|name| folder.join(name).is_file()),
            Self::Ablation => results("rows"),
            Self::Tradeoff => results("axes"),
            Self::Stability => folder.join("stability.json").is_file(),
            Self::Suggestion => results("suggested"),
        }
    }
}

impl RunFolder {
    /// Make and lock `output`, or the [`default_folder`], for a fit; what was made for it goes when
    /// that is interrupted before it is under way.
    pub(super) fn open(output: Option<&Path>, scenes: &[PathBuf]) -> Result<Self, Refusal> {
        let folder = Self::locked(output.map_or_else(|| default_folder(scenes), Path::to_owned))?;
        folder.check(Work::Fit)?;
        Ok(folder.unfinished())
    }

    /// Refuse a folder that another run writes to, or that holds results of another command; what was made goes again.
    pub(super) fn check_free(output: &Path) -> Result<(), Refusal> {
        Self::locked(output.to_owned())?.check(Work::Fit)
    }

    /// Make and lock `output` for a study, which begins anew when it is interrupted.
    pub(super) fn of_study(output: &Path, work: Work) -> Result<Self, Refusal> {
        let folder = Self::locked(output.to_owned())?;
        folder.check(work)?;
        Ok(folder.unfinished())
    }

    /// Make and lock `output` for files that may stand beside a command's results.
    pub(super) fn of_files(output: &Path) -> Result<Self, Refusal> {
        Ok(Self::locked(output.to_owned())?.unfinished())
    }

    /// What was made for it goes when the command is interrupted.
    fn unfinished(self) -> Self {
        unfinished::working(&self.path, self.made.contains(&self.path), &self.made);
        self
    }

    fn locked(path: PathBuf) -> Result<Self, Refusal> {
        let refused = |reason: std::io::Error| OutputError::new(&path, &reason);
        let file = path.join(LOCK);
        let places = std::iter::once(file.as_path()).chain(path.ancestors());
        let made = places.filter(|p| !p.as_os_str().is_empty()).take_while(|p| !p.exists());
        let made = made.map(Path::to_owned).collect();
        std::fs::create_dir_all(&path).map_err(refused)?;
        let lock = File::create(&file).map_err(|reason| OutputError::new(&file, &reason))?;
        if let Err(std::fs::TryLockError::WouldBlock) = lock.try_lock() {
            return Err(Refusal::new(format!(
                "{}: another run is writing to this folder. Wait for it, or choose another with -o.",
                path.display()
            )));
        }
        // A file system without locks: two runs at once are then the user's to avoid.
        Ok(Self { path, _lock: lock, made })
    }

    /// Refuse a folder that holds results of another command: the two would be taken for one.
    fn check(&self, work: Work) -> Result<(), Refusal> {
        let other = Work::ALL.into_iter().find(|&other| other != work && other.left_in(&self.path));
        other.map_or(Ok(()), |other| {
            Err(Refusal::new(format!(
                "{}: this folder holds results of {}, which those of {} would mix with. Choose another with -o.",
                self.path.display(),
                other.command(),
                work.command()
            )))
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// From now on the folder stays: there is something in it.
    pub(super) fn keep(&mut self) {
        self.made.clear();
    }

    /// As [`keep`](Self::keep), of a command that begins anew when it is interrupted: its results are about to be
    /// written.
    pub(super) fn keep_results(&mut self) {
        unfinished::writing(&self.path);
        self.keep();
    }

    /// The scene file as it was fitted, comments and all, as `file` in the folder: its paths are made absolute, so that it
    /// can be used from here, and `changes` stand in place of its own words. Returns the maps that it names.
    pub(super) fn write_scene(
        &self,
        scene: &Path,
        file: &str,
        changes: Changes<'_>,
    ) -> Result<Vec<PathBuf>, Refusal> {
        let text = scene_text(scene, changes)?;
        output::write(&self.path.join(file), text.as_bytes())?;
        Ok(named_maps(&text))
    }
}

/// The text of a scene file with `changes` in the place of its own words, and absolute paths.
pub(super) fn scene_text(scene: &Path, changes: Changes<'_>) -> Result<String, Refusal> {
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
    as_fitted(&text, &folder, changes).map_err(|e| refused(e.message().to_owned()))
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

/// `runs/<the name of the scene's folder>`, with the file's own name after a full stop unless it is `scene.toml`; the
/// built-in scene's is `runs/builtin`, and that of several `runs/<these names with + between them>`.
pub(super) fn default_folder(scenes: &[PathBuf]) -> PathBuf {
    let named = scenes.iter().map(|scene| {
        let absolute = std::path::absolute(scene).unwrap_or_else(|_| scene.clone());
        let words = |part: Option<&std::ffi::OsStr>| part.map(|name| name.to_string_lossy().into_owned());
        let folder = words(absolute.parent().and_then(Path::file_name));
        let file = words(absolute.file_stem()).filter(|name| folder.is_none() || name != "scene");
        folder.into_iter().chain(file).collect::<Vec<_>>().join(".")
    });
    let named = named.collect::<Vec<_>>().join("+");
    Path::new("runs").join(if named.is_empty() { "builtin" } else { &named })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scene_files_of_one_folder_have_run_folders_of_their_own() {
        let of = |scene: &str| default_folder(&[PathBuf::from(scene)]).display().to_string();
        assert_eq!(of("data/head/scene.toml"), "runs/head");
        assert_eq!(of("data/head/night.toml"), "runs/head.night");
        assert_eq!(of("data/head/night.v2.toml"), "runs/head.night.v2");
        // By the folder that it lies in, wherever that is told from.
        let here = std::env::current_dir().unwrap();
        let here = here.file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(
            (of("scene.toml"), of("night.toml")),
            (format!("runs/{here}"), format!("runs/{here}.night"))
        );
        // What lies in no folder is not the built-in scene.
        assert_eq!(
            (of("/scene.toml"), of("/night.toml")),
            ("runs/scene".to_owned(), "runs/night".to_owned())
        );
        assert_eq!(default_folder(&[]), Path::new("runs/builtin"));
        let several = ["data/noon/scene.toml", "data/head/night.toml"].map(PathBuf::from);
        assert_eq!(default_folder(&several), Path::new("runs/noon+head.night"));
    }
}
