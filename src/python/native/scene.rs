//! A scene with the values that one edits of it. The file stays as it is; what is changed goes into the copy that a fit
//! leaves in its run folder.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use pyo3::types::PyDict;
use pyo3::{Bound, Py, PyResult, Python, pyclass, pymethods};
use skinfit_core::model::effects::{Effect, Effects};
use skinfit_core::prepare::{Loaded, PrepareOptions};
use skinfit_core::scene::register_terms;
use skinfit_core::scene::view::Background;
use skinfit_host::cli::{Refusal, parse_effects, save_scene};
use skinfit_view::values::Values;

use crate::errors::Refused;
use crate::maps::MapObjective;
use crate::objective::Objective;
use crate::paint::{self, Painted};
use crate::params;
use crate::waiting::{here, locked, wait};

/// A scene, shared with the threads that work for it.
#[pyclass(frozen, module = "skinfit._native")]
pub(crate) struct Scene(pub(crate) Arc<Read>);

/// A scene as it was read, and what was changed since.
pub(crate) struct Read {
    pub(crate) path: PathBuf,
    /// Where bakes are kept, if they are.
    pub(crate) cache: Option<PathBuf>,
    /// The effects that it was read with, where they are not its file's.
    pub(crate) effects: Option<Effects>,
    pub(crate) loaded: Loaded,
    pub(crate) values: Mutex<Values>,
    /// What drew the last image.
    pub(crate) painted: Mutex<Option<Painted>>,
}

impl Read {
    fn new(path: PathBuf, cache: Option<PathBuf>, effects: Option<&str>) -> Result<Self, Refused> {
        // Effects may be of files of rules that the scene names; what is wrong with it is told below.
        let _ = register_terms(&path);
        let effects: Option<Effects> = effects.map(parse_effects).transpose().map_err(Refused::Scene)?;
        let options = PrepareOptions {
            effects,
            fit: true,
            cache: cache.clone(),
            // Targets show nothing behind the mesh.
            background: Some(Background::None),
            ..PrepareOptions::default()
        };
        let loaded = Loaded::read(&path, &options)?;
        let values = Values::of_scene(&loaded.scene, &loaded.gains);
        Ok(Self { path, cache, effects, loaded, values: Mutex::new(values), painted: Mutex::new(None) })
    }

    /// The values as they stand.
    pub(crate) fn values(&self) -> Values {
        locked(&self.values).clone()
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (path, cache, effects = None))]
    fn new(py: Python<'_>, path: PathBuf, cache: Option<PathBuf>, effects: Option<String>) -> PyResult<Self> {
        let read = wait(py, move || Read::new(path, cache, effects.as_deref()))?;
        Ok(Self(Arc::new(read)))
    }

    /// The scene's file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.0.path.clone()
    }

    /// What the user should know.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.loaded.warnings.clone()
    }

    /// Of each view its name, its width and height in pixels, and whether it has a target.
    #[getter]
    fn views(&self) -> Vec<(String, u32, u32, bool)> {
        let views = self.0.loaded.scene.views.iter();
        views.map(|v| (v.name.clone(), v.camera.width, v.camera.height, v.target.is_some())).collect()
    }

    /// The effects that are on.
    #[getter]
    fn effects(&self) -> Vec<&'static str> {
        self.0.loaded.scene.effects.iter().map(Effect::name).collect()
    }

    /// Where bakes are kept.
    #[getter]
    fn cache(&self) -> Option<PathBuf> {
        self.0.cache.clone()
    }

    /// Whether it is another than its file says.
    #[getter]
    fn is_changed(&self) -> bool {
        self.0.effects.is_some()
            || self.0.values() != Values::of_scene(&self.0.loaded.scene, &self.0.loaded.gains)
    }

    /// The form of the model: `corrected` or `listing`.
    #[getter]
    fn form(&self) -> &'static str {
        self.0.loaded.scene.form.name()
    }

    /// The name of what a fit minimises.
    #[getter]
    fn loss(&self) -> &'static str {
        self.0.loaded.scene.fit.loss.name()
    }

    /// The rows of the parameter table.
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        here(|| params::rows(py, &self.0.values()))
    }

    /// The row of one parameter.
    fn row<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        here(|| params::row_of(py, &self.0.values(), name))
    }

    /// The names of what a fit moves.
    #[getter]
    fn free(&self) -> Vec<String> {
        params::free_names(&self.0.values())
    }

    /// Set a parameter to one number, or to three.
    fn set(&self, name: &str, numbers: Vec<f64>) -> PyResult<()> {
        here(|| params::set(&mut locked(&self.0.values), name, &numbers))
    }

    /// Say what a fit may do to a parameter: `fixed`, `tied` or `per_channel`.
    fn set_freedom(&self, name: &str, freedom: &str) -> PyResult<()> {
        here(|| params::set_freedom(&mut locked(&self.0.values), name, freedom))
    }

    /// Whether the model has a parameter of that name that none of the scene's effects asks for.
    fn is_idle(&self, name: &str) -> bool {
        params::is_idle(&locked(&self.0.values), name)
    }

    /// Have a fit move no parameter, those of effects that are off among them.
    fn fix_all(&self) {
        locked(&self.0.values).free.clear();
    }

    /// Have a parameter stay within two numbers, or within the model's.
    #[pyo3(signature = (name, bounds = None))]
    fn set_bounds(&self, name: &str, bounds: Option<[f64; 2]>) -> PyResult<()> {
        here(|| params::set_bounds(&mut locked(&self.0.values), name, bounds))
    }

    /// Write the scene with its values as a file, with absolute paths.
    fn save(&self, py: Python<'_>, file: PathBuf) -> PyResult<()> {
        let read = Arc::clone(&self.0);
        wait(py, move || {
            let words = |refusal: Refusal| Refused::File(refusal.words().to_owned());
            save_scene(&read.path, &read.values(), &file).map_err(words)
        })
    }

    /// Draw a view by the CPU engine; the first one where none is named. The image and warnings.
    #[pyo3(signature = (view = None, layers = false))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        view: Option<String>,
        layers: bool,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
        let read = Arc::clone(&self.0);
        let (picture, warnings) = wait(py, move || paint::paint(&read, view.as_deref(), layers))?;
        Ok((paint::as_dict(py, picture)?, warnings))
    }

    /// The scene's fit as a function of what is free, over the views that have a target, but for those held out.
    fn objective(&self, py: Python<'_>, hold_out: Vec<String>) -> PyResult<Py<Objective>> {
        Objective::of(py, Arc::clone(&self.0), hold_out)
    }

    /// The same as a function of whole maps, too, on a graphics adapter; part of its name may be given.
    #[pyo3(signature = (maps, hold_out, adapter = None))]
    fn map_objective(
        &self,
        py: Python<'_>,
        maps: Vec<String>,
        hold_out: Vec<String>,
        adapter: Option<String>,
    ) -> PyResult<Py<MapObjective>> {
        MapObjective::of(py, Arc::clone(&self.0), &maps, hold_out, adapter)
    }
}
