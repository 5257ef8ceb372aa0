//! What is looked at: a scene, or the run folder of a fit of one.

use std::path::{Path, PathBuf};

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
    /// Constants that were fitted, as `params.toml`.
    pub(super) fitted: Option<PathBuf>,
    /// What is known of them, as `report.json`: of a run that was stopped there is none.
    pub(super) report: Option<PathBuf>,
}

impl SceneOrRun {
    /// What `path` is.
    ///
    /// # Errors
    /// When it is a folder, and not that of a fit of one scene.
    pub(super) fn of(path: Option<&Path>) -> Result<Self, Refusal> {
        let Some(run) = path.filter(|path| path.is_dir()) else {
            return Ok(Self { run: None, scene: path.map(Path::to_owned), fitted: None, report: None });
        };
        let report = run.join(REPORT);
        Ok(Self {
            run: Some(run.to_owned()),
            scene: Some(file_of(run, SCENE)?),
            fitted: Some(file_of(run, PARAMS)?),
            report: report.is_file().then_some(report),
        })
    }

    /// Where what is made of it is left: the run folder, or that of a fit of the scene.
    pub(super) fn folder(&self) -> PathBuf {
        match &self.run {
            Some(run) => run.clone(),
            None => default_folder(self.scene.as_slice()),
        }
    }
}

/// The constants of a run, or those of a file.
pub(super) fn params_of(path: &Path) -> Result<PathBuf, Refusal> {
    if path.is_dir() { file_of(path, PARAMS) } else { Ok(path.to_owned()) }
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
