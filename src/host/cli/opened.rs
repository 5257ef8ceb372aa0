//! What is looked at: a scene, or the run folder of a fit of one.

use std::path::{Path, PathBuf};

use skinfit_view::Run;
use skinfit_view::{Start, opened::Reading};

use toml_edit::{DocumentMut, Item};

use super::Refusal;
use super::run_folder::default_folder;
use crate::report::SCENES;

/// The scene's file as it was fitted, in a run folder.
pub(super) const SCENE: &str = "scene.toml";
/// What was found.
const PARAMS: &str = "params.toml";
/// Where a fit of the window starts, where its scene's file cannot say it.
pub(super) const START: &str = "start.toml";
/// The report's numbers.
pub(super) const REPORT: &str = "report.json";

/// Scenes that share one skin, or a run.
pub(super) struct SceneOrRun {
    /// The run folder, where it is one.
    pub(super) run: Option<PathBuf>,
    /// The scenes' files; the built-in scene where there is none.
    pub(super) scenes: Vec<PathBuf>,
    /// What it has found.
    pub(super) fitted: Option<Run>,
}

impl SceneOrRun {
    /// What `paths` are.
    ///
    /// # Errors
    /// When one is a folder, and not that of a fit, or there are others beside that.
    pub(super) fn of(paths: &[PathBuf]) -> Result<Self, Refusal> {
        let Some(run) = paths.iter().find(|path| path.is_dir()) else {
            return Ok(Self { run: None, scenes: paths.to_vec(), fitted: None });
        };
        if paths.len() > 1 {
            return Err(Refusal::new(format!(
                "{}: this is a folder, and others are named beside it. Name one run folder, or scene files.",
                run.display()
            )));
        }
        let fitted = Some(run_of(run)?);
        Ok(Self { run: Some(run.clone()), scenes: scenes_of(run)?, fitted })
    }

    /// What a window begins with: the scenes' files at `paths`, bakes in `cache`, fits beside what is looked at.
    pub(super) fn start(self, paths: Vec<PathBuf>, cache: Option<&Path>) -> Start {
        let reading = |scene| Reading { scene, cache: cache.map(Path::to_owned), ..Reading::default() };
        Start {
            run: PathBuf::from(format!("{}.window", self.folder().display())),
            scenes: paths.into_iter().map(reading).collect(),
            fitted: self.fitted,
            ..Start::default()
        }
    }

    /// Where what is made of it is left: the run folder, or that of a fit of the scenes.
    pub(super) fn folder(&self) -> PathBuf {
        match &self.run {
            Some(run) => run.clone(),
            None => default_folder(&self.scenes),
        }
    }
}

/// The scenes' files of a run folder, in the order in which they were fitted: of several the constants name them.
fn scenes_of(run: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let constants = std::fs::read_to_string(run.join(PARAMS)).unwrap_or_default();
    let constants: DocumentMut = constants.parse().unwrap_or_default();
    let names = constants.get(SCENES).and_then(Item::as_table_like);
    let names: Vec<String> =
        names.into_iter().flat_map(|names| names.iter()).map(|(name, _)| name.to_owned()).collect();
    match names.as_slice() {
        [] => Ok(vec![file_of(run, SCENE)?]),
        names => names.iter().map(|name| file_of(run, &scene_file(name, true))).collect(),
    }
}

/// A scene's file in a run folder: of `several` by its name.
pub(super) fn scene_file(name: &str, several: bool) -> String {
    if several { format!("{SCENES}/{name}.toml") } else { SCENE.to_owned() }
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
        "{}: this folder holds no {name}: it is not that of a fit. Name the run folder of one, or a scene file.",
        run.display()
    )))
}
