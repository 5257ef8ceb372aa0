//! Images as arrays, row by row from the top, and arrays as files that a scene names.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use exr::prelude::{Image as Exr, SpecificChannels, Vec2, WritableImage as _};
use numpy::ndarray::Dimension;
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray, PyReadonlyArray3};
use pyo3::{Bound, PyResult, Python, pyfunction};
use skinfit_core::output::{self, OutputError};
use skinfit_core::render::image::Image;

use crate::errors::Refused;
use crate::waiting::wait;

/// The colours of an image, (height, width, 3).
pub(crate) fn rgb(py: Python<'_>, image: Image) -> PyResult<Bound<'_, PyArray3<f32>>> {
    PyArray1::from_vec(py, image.rgb.into_flattened()).reshape([image.height, image.width, 3])
}

/// The coverage of an image, (height, width).
pub(crate) fn alpha<'py>(py: Python<'py>, image: &Image) -> PyResult<Bound<'py, PyArray2<f32>>> {
    plane(py, image.alpha.clone(), [image.height, image.width])
}

/// A number a pixel, (height, width).
pub(crate) fn plane(
    py: Python<'_>,
    numbers: Vec<f32>,
    size: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<f32>>> {
    PyArray1::from_vec(py, numbers).reshape(size)
}

/// The numbers of an array, row by row.
pub(crate) fn numbers<T: Element + Copy, D: Dimension>(array: &PyReadonlyArray<'_, T, D>) -> Vec<T> {
    let array = array.as_array();
    // At once where they lie so already.
    array.as_slice().map_or_else(|| array.iter().copied().collect(), <[T]>::to_vec)
}

/// Write an array of (height, width, 3), or of (height, width, 4) with coverage, as an OpenEXR file of 32-bit floats,
/// whole or not at all.
#[pyfunction]
pub(crate) fn write_exr(py: Python<'_>, file: PathBuf, numbers: PyReadonlyArray3<'_, f32>) -> PyResult<()> {
    let (height, width, channels) = numbers.as_array().dim();
    let numbers = self::numbers(&numbers);
    wait(py, move || {
        if !(3..=4).contains(&channels) || height == 0 || width == 0 {
            return Err(Refused::Array(format!(
                "an array of {height} x {width} x {channels} is no image. Give three numbers a pixel, or four with \
                 coverage."
            )));
        }
        write(&file, &numbers, [width, height, channels])
    })
}

fn write(file: &Path, numbers: &[f32], [width, height, channels]: [usize; 3]) -> Result<(), Refused> {
    let at = |x: usize, y: usize, channel: usize| numbers[(y * width + x) * channels + channel];
    let colour = |p: Vec2<usize>| (at(p.x(), p.y(), 0), at(p.x(), p.y(), 1), at(p.x(), p.y(), 2));
    let covered = |p: Vec2<usize>| {
        let (r, g, b) = colour(p);
        (r, g, b, at(p.x(), p.y(), 3))
    };
    let mut bytes = Cursor::new(Vec::new());
    let size = (width, height);
    let written = if channels == 3 {
        Exr::from_channels(size, SpecificChannels::rgb(colour)).write().to_buffered(&mut bytes)
    } else {
        Exr::from_channels(size, SpecificChannels::rgba(covered)).write().to_buffered(&mut bytes)
    };
    written.map_err(|error| OutputError::new(file, &error))?;
    Ok(output::write(file, &bytes.into_inner())?)
}
