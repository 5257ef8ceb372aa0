//! A scene's fit as a function of what is free, for other solvers: loss, gradient and normal equations by the CPU engine,
//! in the numbers that a fit of the command line sees; images and their Jacobian's products in f64, by the rules.

use std::sync::Arc;

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound, Py, PyClassInitializer, PyResult, Python, pyclass, pymethods};
use skinfit_core::engine::cpu::CpuEngine;
use skinfit_core::engine::reference::{PixelColumns, Reference};
use skinfit_core::engine::view::ObservedView;
use skinfit_core::engine::{NormalEquations, Objective as _, Unknown};
use skinfit_core::prepare::Observed;

use crate::arrays::numbers;
use crate::errors::Refused;
use crate::free::{Constants, Free, observe};
use crate::scene::Read;
use crate::waiting::wait;

/// The objective of a scene at the values that it had.
#[pyclass(frozen, extends = Constants, module = "skinfit._native")]
pub(crate) struct Objective(Arc<Observing>);

struct Observing {
    free: Arc<Free>,
    views: Arc<[ObservedView]>,
    engine: CpuEngine,
}

/// Products of a view's Jacobian take the numbers of each pixel and channel: its place in the image, its value, and a row
/// of the Jacobian.
type Take<'a> = &'a mut dyn FnMut(usize, f64, &[f64]);

impl Objective {
    /// Of a scene as it stands, over the views that have a target and are not held out.
    pub(crate) fn of(py: Python<'_>, read: Arc<Read>, hold_out: Vec<String>) -> PyResult<Py<Self>> {
        let own = wait(py, move || {
            let observed = observe(&read, &hold_out, |_| Ok(()))?;
            let engine = observed.engine()?;
            let Observed { baked, views } = observed;
            Ok(Observing { free: Arc::new(Free::new(baked)), views, engine })
        })?;
        let constants = PyClassInitializer::from(Constants(Arc::clone(&own.free)));
        Py::new(py, constants.add_subclass(Self(Arc::new(own))))
    }
}

impl Observing {
    /// Have `take` see each pixel and channel of a view: radiance premultiplied by the coverage, times the gain. Rows have a
    /// number for each of `unknowns`.
    fn rows(&self, x: &[f64], view: usize, unknowns: &[Unknown], take: Take<'_>) -> Result<(), Refused> {
        let baked = &self.free.baked;
        let point = self.free.at(x)?;
        let (light, loss) = (&baked.illumination, baked.scene.fit.loss);
        let reference = Reference::new(baked.setup(), light, &self.views, loss, unknowns)?;
        let samples = &self.views[view].samples;
        let pixels: Vec<PixelColumns> = reference.pixels(view, &point.params);
        for ((slot, pixel), &place) in pixels.into_iter().enumerate().zip(&samples.pixel) {
            if place == u32::MAX {
                continue;
            }
            let coverage = f64::from(samples.coverage[slot]);
            for (channel, (value, mut row)) in pixel.into_iter().enumerate().take(3) {
                let share = coverage * point.gains[view].channel(channel);
                row.iter_mut().for_each(|slope| *slope *= share);
                for (slope, unknown) in row.iter_mut().zip(unknowns) {
                    if unknown.is_gain_of(view, channel) {
                        *slope = coverage * value;
                    }
                }
                take(3 * place as usize + channel, share * value, &row);
            }
        }
        Ok(())
    }

    /// A number for each pixel and channel of a view, made of its value and its row.
    fn image(
        &self,
        x: &[f64],
        view: Option<&str>,
        unknowns: &[Unknown],
        of: impl Fn(f64, &[f64]) -> f64,
    ) -> Result<Plane, Refused> {
        let view = self.free.view(view)?;
        let size = self.free.size(view);
        let mut numbers = vec![0.0; 3 * size[0] * size[1]];
        self.rows(x, view, unknowns, &mut |place, value, row| numbers[place] = of(value, row))?;
        Ok(Plane { numbers, size })
    }

    /// Refuse what is no direction in which constants move.
    fn check_direction(&self, v: &[f64]) -> Result<(), Refused> {
        let (given, wanted) = (v.len(), self.free.names.len());
        if given != wanted {
            return Err(Refused::Array(format!("a vector of {given}, where {wanted} constants are free.")));
        }
        match v.iter().position(|number| !number.is_finite()) {
            None => Ok(()),
            Some(place) => Err(Refused::Array(format!(
                "the vector moves {} by {}. Give finite numbers.",
                self.free.names[place], v[place]
            ))),
        }
    }
}

/// Three numbers a pixel.
struct Plane {
    numbers: Vec<f64>,
    size: [usize; 2],
}

impl Plane {
    fn array(self, py: Python<'_>) -> PyResult<Bound<'_, PyArray3<f64>>> {
        let [height, width] = self.size;
        PyArray1::from_vec(py, self.numbers).reshape([height, width, 3])
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[pymethods]
impl Objective {
    /// The loss.
    fn loss(&self, py: Python<'_>, x: PyReadonlyArray1<'_, f64>) -> PyResult<f64> {
        let (own, x) = (Arc::clone(&self.0), numbers(&x));
        wait(py, move || Ok(own.engine.loss(&own.free.at(&x)?)))
    }

    /// The loss and its gradient.
    fn loss_and_gradient<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<(f64, Bound<'py, PyArray1<f64>>)> {
        let (own, x) = (Arc::clone(&self.0), numbers(&x));
        let (loss, gradient) = wait(py, move || Ok(own.engine.gradient(&own.free.at(&x)?)))?;
        Ok((loss, PyArray1::from_vec(py, gradient)))
    }

    /// Loss, J^T r and J^T J, with the sums of weights and of squared residuals, as a dictionary.
    fn normal_equations<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (own, x) = (Arc::clone(&self.0), numbers(&x));
        let sums: NormalEquations = wait(py, move || Ok(own.engine.normal_equations(&own.free.at(&x)?)))?;
        let (all, order) = (PyDict::new(py), self.0.free.names.len());
        let jtj: Bound<'py, PyArray2<f64>> = PyArray1::from_vec(py, sums.jtj).reshape([order, order])?;
        all.set_item("loss", sums.loss)?;
        all.set_item("residual", sums.residual)?;
        all.set_item("weight", sums.weight)?;
        all.set_item("count", sums.count)?;
        all.set_item("jtr", PyArray1::from_vec(py, sums.jtr))?;
        all.set_item("jtj", jtj)?;
        Ok(all)
    }

    /// A view's image.
    #[pyo3(signature = (x, view = None))]
    fn image<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        view: Option<String>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (own, x) = (Arc::clone(&self.0), numbers(&x));
        wait(py, move || own.image(&x, view.as_deref(), &[], |value, _| value))?.array(py)
    }

    /// The Jacobian of a view's image times a vector.
    #[pyo3(signature = (x, v, view = None))]
    fn jvp<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        v: PyReadonlyArray1<'_, f64>,
        view: Option<String>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (own, x, v) = (Arc::clone(&self.0), numbers(&x), numbers(&v));
        let product = move || {
            own.check_direction(&v)?;
            own.image(&x, view.as_deref(), &own.free.unknowns, |_, row| dot(row, &v))
        };
        wait(py, product)?.array(py)
    }

    /// An image times the Jacobian of a view's image.
    #[pyo3(signature = (x, image, view = None))]
    fn vjp<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        image: PyReadonlyArray3<'_, f64>,
        view: Option<String>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (own, x) = (Arc::clone(&self.0), numbers(&x));
        let (shape, image) = (image.shape().to_vec(), numbers(&image));
        let product = move || {
            let view = own.free.view_of_image(view.as_deref(), &shape)?;
            let mut sums = vec![0.0; own.free.names.len()];
            own.rows(&x, view, &own.free.unknowns, &mut |place, _, row| {
                sums.iter_mut().zip(row).for_each(|(sum, slope)| *sum += image[place] * slope);
            })?;
            Ok(sums)
        };
        Ok(PyArray1::from_vec(py, wait(py, product)?))
    }
}
