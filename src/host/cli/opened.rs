//! What is looked at: a scene, or the run folder of a fit of one.

use std::path::{Path, PathBuf};

use skinfit_view::Run;
#[cfg(feature = "view")]
use skinfit_view::{Start, opened::Reading};

use super::Refusal;
use super::run_folder::default_folder;

/// The scene's file as it was fitted, in a run folder.
pub(super) const SCENE: &str = "scene.toml";
/// What was found.
const PARAMS: &str = "params.toml";
/// The report's numbers.
pub(super) const REPORT: &str = "report.json";

/// A scene or a run.
pub(super) struct SceneOrRun {
    /// The run folder, where it is one.
    pub(super) run: Option<PathBuf>,
    /// The scene's file; the built-in scene where there is none.
    pub(super) scene: Option<PathBuf>,
    /// What it has found.
    pub(super) fitted: Option<Run>,
}

impl SceneOrRun {
    /// What `path` is.
    ///
    /// # Errors
    /// When it is a folder, and not that of a fit of one scene.
    pub(super) fn of(path: Option<&Path>) -> Result<Self, Refusal> {
        let Some(run) = path.filter(|path| path.is_dir()) else {
            return Ok(Self { run: None, scene: path.map(Path::to_owned), fitted: None });
        };
        let (scene, fitted) = (Some(file_of(run, SCENE)?), Some(run_of(run)?));
        Ok(Self { run: Some(run.to_owned()), scene, fitted })
    }

    /// What a window begins with: the scene's file at `path`, bakes in `cache`, fits beside what is looked at.
    #[cfg(feature = "view")]
    pub(super) fn start(self, path: PathBuf, cache: Option<PathBuf>) -> Start {
        Start {
            run: PathBuf::from(format!("{}.window", self.folder().display())),
            reading: Reading { scene: path, cache, ..Reading::default() },
            fitted: self.fitted,
            ..Start::default()
        }
    }

    /// Where what is made of it is left: the run folder, or that of a fit of the scene.
    pub(super) fn folder(&self) -> PathBuf {
        match &self.run {
            Some(run) => run.clone(),
            None => default_folder(self.scene.as_slice()),
        }
    }
}

/// What a run folder holds of its fit, or a file of constants.
pub(super) fn run_of(path: &Path) -> Result<Run, Refusal> {
    if !path.is_dir() {
        return Ok(Run { params: path.to_owned(), report: None });
    }
    // Of a run that was stopped there is none.
    let report = Some(path.join(REPORT)).filter(|report| report.is_file());
    Ok(Run { params: file_of(path, PARAMS)?, report })
}

/// A file of a run folder.
fn file_of(run: &Path, name: &str) -> Result<PathBuf, Refusal> {
    let file = run.join(name);
    if file.is_file() {
        return Ok(file);
    }
    Err(Refusal::new(format!(
        "{}: this folder holds no {name}: it is not that of a fit of one scene. Name the run folder of one, or a scene \
         file.",
        run.display()
    )))
}
