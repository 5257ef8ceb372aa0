//! A view as an image, drawn by the CPU engine as `skinfit render --engine cpu --layers` draws it.

use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound, PyResult, Python};
use skinfit_core::model::params::Params;
use skinfit_core::prepare::{Loaded, PrepareOptions, Views};
use skinfit_core::samples::{check_uvs, nothing_visible};
use skinfit_core::scene::Scene;
use skinfit_core::scene::view::View;
use skinfit_gpu::painter::{Beside, CpuPainter, Painter as _, Picture};
use skinfit_view::values::Values;

use crate::arrays::{alpha, plane, rgb};
use crate::errors::Refused;
use crate::scene::Read;
use crate::waiting::locked;

/// What drew an image: other weights alone need no other bakes and no other samples.
pub(crate) struct Painted {
    painter: CpuPainter,
    view: View,
    /// Of the bakes.
    params: Params,
    warnings: Vec<String>,
}

impl Painted {
    /// Read and bake the scene for one of its views, as it was told to be.
    fn new(read: &Read, view: Option<&str>, values: &Values) -> Result<Self, Refused> {
        let options = PrepareOptions {
            effects: read.effects,
            views: view.map_or(Views::First, |view| Views::Named(view.to_owned())),
            cache: read.cache.clone(),
            ..PrepareOptions::default()
        };
        let mut loaded = Loaded::read(&read.path, &options)?;
        loaded.scene.params.clone_from(&values.params);
        let baked = loaded.bake()?;
        check_uvs(&baked.scene, &baked.scene.mesh.uvs)?;
        let Scene { views, params, .. } = &*baked.scene;
        let (view, params) = (views[0].clone(), params.clone());
        Ok(Self { painter: CpuPainter::new(&baked)?, view, params, warnings: baked.warnings })
    }

    /// Whether it draws the view at these values, but for weights.
    fn draws(&self, view: &str, values: &Values) -> bool {
        self.view.name == view && self.params.differ_in_weights_alone(&values.params)
    }
}

/// Draw a view of a scene at its values; the first one where none is named. What was warned of the first time.
pub(crate) fn paint(
    read: &Read,
    view: Option<&str>,
    layers: bool,
) -> Result<(Picture, Vec<String>), Refused> {
    let values = read.values();
    let first = || read.loaded.scene.views.first().map_or("", |view| view.name.as_str());
    let mut painted = locked(&read.painted);
    let mut warnings = Vec::new();
    // Taken out while it draws: what is left half changed does not stay.
    let kept = painted.take().filter(|painted| painted.draws(view.unwrap_or_else(first), &values));
    let mut now = match kept {
        Some(kept) => kept,
        None => {
            let mut new = Painted::new(read, view, &values)?;
            warnings = std::mem::take(&mut new.warnings);
            new
        }
    };
    now.painter.set_params(&values.params)?;
    let place = read.loaded.scene.views.iter().position(|view| view.name == now.view.name);
    let gain = place.and_then(|place| values.gains.get(place)).copied().unwrap_or_default();
    let picture = now.painter.paint(&now.view.camera, gain, Beside { layers, haze: layers })?;
    if picture.image.alpha.iter().all(|&alpha| alpha == 0.0) {
        return Err(nothing_visible(&read.loaded.scene, &now.view).into());
    }
    *painted = Some(now);
    Ok((picture, warnings))
}

/// An image as arrays: `image`, `alpha`, `layers` by their names, `haze`.
pub(crate) fn as_dict(py: Python<'_>, picture: Picture) -> PyResult<Bound<'_, PyDict>> {
    let all = PyDict::new(py);
    let size = [picture.image.height, picture.image.width];
    all.set_item("alpha", alpha(py, &picture.image)?)?;
    all.set_item("image", rgb(py, picture.image)?)?;
    let layers = PyDict::new(py);
    for (name, image) in picture.layers {
        layers.set_item(name, rgb(py, image)?)?;
    }
    all.set_item("layers", layers)?;
    let haze = (!picture.haze.is_empty()).then(|| plane(py, picture.haze, size)).transpose()?;
    all.set_item("haze", haze)?;
    Ok(all)
}
