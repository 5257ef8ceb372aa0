//! What is free of a scene's fit: names, bounds, and the points that vectors stand for.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::{Bound, Python, pyclass, pymethods};
use skinfit_core::engine::joint::label;
use skinfit_core::engine::{Point, Unknown};
use skinfit_core::prepare::{Baked, NamedScene, Observed, PrepareError, untied};
use skinfit_core::scene::{FitSettings, short, suggestion};

use crate::errors::Refused;
use crate::scene::Read;

/// The views of a scene that have a target, as its values were, and what is free there.
pub(crate) struct Free {
    pub(crate) baked: Baked,
    pub(crate) unknowns: Vec<Unknown>,
    pub(crate) names: Vec<String>,
}

/// A scene as it stands beside what was observed, without the views that are held out. `check` sees what is free before
/// anything is baked.
pub(crate) fn observe(
    read: &Read,
    hold_out: &[String],
    check: impl FnOnce(&FitSettings) -> Result<(), Refused>,
) -> Result<Observed, Refused> {
    let values = read.values();
    let mut loaded = read.loaded.clone();
    loaded.scene.params.clone_from(&values.params);
    loaded.scene.fit.bounds.clone_from(&values.bounds);
    loaded.scene.fit.free = untied(&values.free, &values.params, &[]);
    check(&loaded.scene.fit)?;
    let scene = NamedScene { name: String::new(), loaded };
    let marked = NamedScene::marked(std::slice::from_ref(&scene), hold_out);
    let marks = marked.map_err(PrepareError::from)?.concat();
    let (baked, _) = scene.loaded.bake()?.hold_out(&marks)?;
    Ok(baked.sample()?.observe()?)
}

impl Free {
    pub(crate) fn new(baked: Baked) -> Self {
        let unknowns = baked.unknowns();
        let view = |number: usize| baked.scene.views.get(number).map(|view| view.name.clone());
        let names = unknowns.iter().map(|unknown| label(&unknown.name(), |_| None, view)).collect();
        Self { unknowns, names, baked }
    }

    /// The point of these values, each of which its unknown may have.
    pub(crate) fn at(&self, x: &[f64]) -> Result<Point, Refused> {
        if x.len() != self.unknowns.len() {
            let (given, wanted) = (x.len(), self.unknowns.len());
            let names = self.names.join(", ");
            return Err(Refused::Array(format!(
                "{given} values, where {wanted} are free: {names}. Give one for each."
            )));
        }
        let mut point = self.baked.start();
        let bounded = self.unknowns.iter().zip(self.bounds());
        for (((unknown, (lower, upper)), &value), name) in bounded.zip(x).zip(&self.names) {
            if !value.is_finite() || !(lower..=upper).contains(&value) {
                let [lower, upper] = [lower, upper].map(short);
                return Err(Refused::Param(format!(
                    "{name} = {value} is out of bounds. Give a number from {lower} to {upper}."
                )));
            }
            unknown.set(&mut point, value);
        }
        Ok(point)
    }

    /// Least and greatest value of each.
    pub(crate) fn bounds(&self) -> Vec<(f64, f64)> {
        let within = std::slice::from_ref(&self.baked.scene.fit.bounds);
        self.unknowns.iter().map(|unknown| unknown.bounds_within(within)).collect()
    }

    /// The number of a view; the first's where none is named.
    pub(crate) fn view(&self, name: Option<&str>) -> Result<usize, Refused> {
        let Some(name) = name else { return Ok(0) };
        let views = &self.baked.scene.views;
        let known: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
        let unknown = || {
            let scene = self.baked.scene.path.display();
            Refused::View(format!(
                "{scene}: there is no view `{name}` to be fitted. {}.",
                suggestion(name, &known)
            ))
        };
        views.iter().position(|view| view.name == name).ok_or_else(unknown)
    }

    /// Height and width of a view.
    pub(crate) fn size(&self, view: usize) -> [usize; 2] {
        let camera = &self.baked.scene.views[view].camera;
        [camera.height as usize, camera.width as usize]
    }

    /// The number of a view, of which an image of this shape is given.
    pub(crate) fn view_of_image(&self, name: Option<&str>, shape: &[usize]) -> Result<usize, Refused> {
        let view = self.view(name)?;
        let [height, width] = self.size(view);
        if *shape == [height, width, 3] {
            return Ok(view);
        }
        Err(Refused::Array(format!(
            "an array of {shape:?}, where the view has {height} x {width} pixels of three numbers."
        )))
    }
}

/// What the functions of what is free have in common.
#[pyclass(frozen, subclass, module = "skinfit._native")]
pub(crate) struct Constants(pub(crate) Arc<Free>);

#[pymethods]
impl Constants {
    /// The names of what is free, in the order of every vector.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.names.clone()
    }

    /// The views over which it is.
    #[getter]
    fn views(&self) -> Vec<String> {
        self.0.baked.scene.views.iter().map(|view| view.name.clone()).collect()
    }

    /// What the user should know.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.baked.warnings.clone()
    }

    /// The values that the scene had.
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let start = self.0.baked.start();
        PyArray1::from_vec(py, self.0.unknowns.iter().map(|unknown| unknown.get(&start)).collect())
    }

    /// Least and greatest value of each.
    #[getter]
    fn bounds(&self) -> Vec<(f64, f64)> {
        self.0.bounds()
    }
}
