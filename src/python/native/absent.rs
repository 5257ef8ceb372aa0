//! What stands in where the library is built without the functions of maps.

use std::path::Path;
use std::sync::Arc;

use pyo3::{PyResult, Python};
use skinfit_core::engine::Point;
use skinfit_core::engine::view::ObservedView;
use skinfit_core::model::params::Param;
use skinfit_core::scene::MapKind;

use crate::errors::Refused;
use crate::free::Free;
use crate::maps::{GivenMaps, Gradients, Map};

/// Nobody makes one.
pub(crate) enum Function {}

fn absent() -> Refused {
    Refused::Device(
        "this library was built without gradients with respect to maps. Build it with `pip install ./src/python \
         --config-settings build-args=\"--features burn\"`."
            .to_owned(),
    )
}

#[allow(clippy::needless_pass_by_value, reason = "as where there are functions")]
impl Function {
    pub(crate) fn check(_: &Path, _: &[MapKind], _: impl Iterator<Item = Param>) -> Result<(), Refused> {
        Err(absent())
    }

    pub(crate) fn new(
        _: Python<'_>,
        _: &Arc<Free>,
        _: Arc<[ObservedView]>,
        _: Vec<MapKind>,
        _: Option<String>,
    ) -> PyResult<Self> {
        Err(absent().into())
    }

    pub(crate) fn adapter(&self) -> &str {
        match *self {}
    }

    pub(crate) fn maps(&self) -> &[Map] {
        match *self {}
    }

    pub(crate) fn start(&self, _: Python<'_>) -> PyResult<Vec<Vec<f32>>> {
        match *self {}
    }

    pub(crate) fn loss(&self, _: Python<'_>, _: Point, _: GivenMaps) -> PyResult<f64> {
        match *self {}
    }

    pub(crate) fn loss_and_gradient(
        &self,
        _: Python<'_>,
        _: Point,
        _: GivenMaps,
    ) -> PyResult<(f64, Gradients)> {
        match *self {}
    }

    pub(crate) fn image(&self, _: Python<'_>, _: usize, _: Point, _: GivenMaps) -> PyResult<Vec<f32>> {
        match *self {}
    }

    pub(crate) fn vjp(
        &self,
        _: Python<'_>,
        _: usize,
        _: Point,
        _: GivenMaps,
        _: Vec<f32>,
    ) -> PyResult<Gradients> {
        match *self {}
    }
}
