//! Images as arrays, row by row from the top, and arrays as files that a scene names.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use exr::prelude::{Image as Exr, SpecificChannels, WritableImage as _};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
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

/// Write an array of (height, width, 3), or of (height, width, 4) with coverage, as an OpenEXR file of 32-bit floats,
/// whole or not at all.
#[pyfunction]
pub(crate) fn write_exr(py: Python<'_>, file: PathBuf, numbers: PyReadonlyArray3<'_, f32>) -> PyResult<()> {
    let &[height, width, channels] = numbers.shape() else { unreachable!("it has three dimensions") };
    let numbers: Vec<f32> = numbers.as_array().iter().copied().collect();
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
    let colour = |x, y| (at(x, y, 0), at(x, y, 1), at(x, y, 2));
    let mut bytes = Cursor::new(Vec::new());
    let written = if channels == 3 {
        let image = Exr::from_channels(
            (width, height),
            SpecificChannels::rgb(|p: exr::math::Vec2<usize>| colour(p.x(), p.y())),
        );
        image.write().to_buffered(&mut bytes)
    } else {
        let covered = |p: exr::math::Vec2<usize>| {
            let (r, g, b) = colour(p.x(), p.y());
            (r, g, b, at(p.x(), p.y(), 3))
        };
        Exr::from_channels((width, height), SpecificChannels::rgba(covered)).write().to_buffered(&mut bytes)
    };
    written.map_err(|error| OutputError::new(file, &error))?;
    Ok(output::write(file, &bytes.into_inner())?)
}
