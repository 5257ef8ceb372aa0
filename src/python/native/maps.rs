//! A scene's fit as a function of what is free and of whole maps, on a graphics adapter: images, loss and gradients in 32
//! bits.

use std::sync::Arc;

use numpy::{
    PyArray1, PyArray3, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray3, PyReadonlyArrayDyn,
    PyUntypedArrayMethods as _,
};
use pyo3::types::{PyAnyMethods as _, PyDict, PyDictMethods as _};
use pyo3::{Bound, Py, PyClassInitializer, PyErr, PyResult, Python, pyclass, pymethods};
use skinfit_core::engine::Point;
use skinfit_core::prepare::Observed;
use skinfit_core::scene::{MapKind, suggestion};

use crate::arrays::numbers;
use crate::errors::Refused;
use crate::free::{Constants, Free, observe};
use crate::scene::Read;
use crate::tensors::Function;
use crate::waiting::{here, wait};

/// A map: its name, the shape of its array, and the least and greatest value that a fit allows.
pub(crate) struct Map {
    pub(crate) name: &'static str,
    pub(crate) shape: Vec<usize>,
    pub(crate) bounds: (f64, f64),
}

/// The numbers of maps, in the order of the function's; of those that are not given the start's count.
pub(crate) type GivenMaps = Vec<Option<Vec<f32>>>;

/// Slopes by constants, and by the numbers of each map.
pub(crate) type Gradients = (Vec<f64>, Vec<Vec<f32>>);

/// The objective of a scene at the values that it had, over maps as well.
#[pyclass(frozen, extends = Constants, module = "skinfit._native")]
pub(crate) struct MapObjective {
    free: Arc<Free>,
    function: Function,
}

impl MapObjective {
    /// Of a scene as it stands, over the views that have a target and are not held out.
    pub(crate) fn of(
        py: Python<'_>,
        read: Arc<Read>,
        maps: &[String],
        hold_out: Vec<String>,
        adapter: Option<String>,
    ) -> PyResult<Py<Self>> {
        let path = read.path.clone();
        let kinds: Vec<MapKind> = maps.iter().map(|name| kind(name)).collect::<Result<_, _>>()?;
        let of = kinds.clone();
        let observed = wait(py, move || {
            observe(&read, &hold_out, |fit| {
                Function::check(&path, &of, fit.free.iter().map(|column| column.param))
            })
        })?;
        let Observed { baked, views } = observed;
        let free = Arc::new(Free::new(baked));
        let function = Function::new(py, &free, views, kinds, adapter)?;
        let constants = PyClassInitializer::from(Constants(Arc::clone(&free)));
        Py::new(py, constants.add_subclass(Self { free, function }))
    }

    /// The point of a vector and the maps of a dictionary.
    fn asked(&self, x: &PyReadonlyArray1<'_, f64>, maps: &Bound<'_, PyDict>) -> PyResult<(Point, GivenMaps)> {
        here(|| Ok::<_, PyErr>((self.free.at(&numbers(x))?, self.given(maps)?)))
    }

    /// The maps of a dictionary.
    fn given(&self, maps: &Bound<'_, PyDict>) -> PyResult<GivenMaps> {
        let known = self.function.maps();
        let mut given: GivenMaps = known.iter().map(|_| None).collect();
        for (name, array) in maps {
            let name: String = name.extract()?;
            let array: PyReadonlyArrayDyn<'_, f32> = array.extract()?;
            let names: Vec<&str> = known.iter().map(|map| map.name).collect();
            let unknown =
                || Refused::Array(format!("`{name}` is none of these maps. {}.", suggestion(&name, &names)));
            let place = names.iter().position(|known| *known == name).ok_or_else(unknown)?;
            let (found, wanted) = (array.shape(), &known[place].shape);
            if found != wanted {
                return Err(Refused::Array(format!(
                    "{name}: an array of {found:?}, where the map is one of {wanted:?}."
                ))
                .into());
            }
            let numbers = numbers(&array);
            if !numbers.iter().all(|number| number.is_finite()) {
                return Err(Refused::Array(format!("{name}: not all of its numbers are finite.")).into());
            }
            given[place] = Some(numbers);
        }
        Ok(given)
    }

    /// Maps as a dictionary of arrays.
    fn arrays<'py>(&self, py: Python<'py>, maps: Vec<Vec<f32>>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (map, numbers) in self.function.maps().iter().zip(maps) {
            all.set_item(map.name, PyArray1::from_vec(py, numbers).reshape(map.shape.as_slice())?)?;
        }
        Ok(all)
    }
}

/// The maps of that name.
fn kind(name: &str) -> Result<MapKind, Refused> {
    let names = MapKind::ALL.map(MapKind::name);
    let unknown = || Refused::Array(format!("there are no maps `{name}`. {}.", suggestion(name, &names)));
    MapKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(unknown)
}

#[pymethods]
impl MapObjective {
    /// The adapter's name.
    #[getter]
    fn adapter(&self) -> &str {
        self.function.adapter()
    }

    /// By its name, the least and greatest value of each map.
    #[getter]
    fn map_bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.function.maps().iter().try_for_each(|map| all.set_item(map.name, map.bounds))?;
        Ok(all)
    }

    /// By its name, each map as it was at the start.
    #[getter]
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.arrays(py, self.function.start(py)?)
    }

    /// The loss.
    fn loss(&self, py: Python<'_>, x: PyReadonlyArray1<'_, f64>, maps: &Bound<'_, PyDict>) -> PyResult<f64> {
        let (point, maps) = self.asked(&x, maps)?;
        self.function.loss(py, point, maps)
    }

    /// The loss, and its gradients by constants and maps.
    #[allow(clippy::type_complexity, reason = "what Python takes apart")]
    fn loss_and_gradient<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        maps: &Bound<'_, PyDict>,
    ) -> PyResult<(f64, Bound<'py, PyArray1<f64>>, Bound<'py, PyDict>)> {
        let (point, maps) = self.asked(&x, maps)?;
        let (loss, (constants, maps)) = self.function.loss_and_gradient(py, point, maps)?;
        Ok((loss, PyArray1::from_vec(py, constants), self.arrays(py, maps)?))
    }

    /// A view's image.
    #[pyo3(signature = (x, maps, view = None))]
    fn image<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        maps: &Bound<'_, PyDict>,
        view: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let (view, (point, maps)) = (self.free.view(view)?, self.asked(&x, maps)?);
        let [height, width] = self.free.size(view);
        let image = self.function.image(py, view, point, maps)?;
        PyArray1::from_vec(py, image).reshape([height, width, 3])
    }

    /// An image times the Jacobian of a view's image, by constants and maps.
    #[pyo3(signature = (x, maps, image, view = None))]
    fn vjp<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        maps: &Bound<'_, PyDict>,
        image: PyReadonlyArray3<'_, f32>,
        view: Option<&str>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyDict>)> {
        let view = self.free.view_of_image(view, image.shape())?;
        let (point, maps) = self.asked(&x, maps)?;
        let (constants, maps) = self.function.vjp(py, view, point, maps, numbers(&image))?;
        Ok((PyArray1::from_vec(py, constants), self.arrays(py, maps)?))
    }
}
