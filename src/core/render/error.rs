//! Why an image cannot be written.

use std::path::PathBuf;

use crate::output::OutputError;

/// The longest side of an image file, in pixels.
pub const MAX_SIDE: usize = 32_768;
/// The most pixels in an image file.
pub const MAX_PIXELS: usize = 1 << 28;

/// An image could not be written; nothing new stands at its path.
#[derive(Debug, thiserror::Error)]
pub enum ImageFileError {
    /// The name's ending is none that can be written.
    #[error("{}: the name ends in {ending}, which is no image format that can be written. Use .exr (linear, floating point) or .png (8 bits, tone-mapped).", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What it ends in, in words.
        ending: String,
    },
    /// Too large, or nothing.
    #[error("{}: an image of {width} x {height} pixels cannot be written. Each side must be 1 to {MAX_SIDE} pixels, with at most {MAX_PIXELS} pixels in all: change width and height of the view.", path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
    /// The arrays do not hold width x height pixels, or a layer is of another size.
    #[error("{}: an image of {width} x {height} pixels cannot be made of {found}. Give every plane width x height values.", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// What there was instead.
        found: String,
    },
    /// A pixel is NaN or infinite.
    #[error("{}: pixel ({x}, {y}) is not a finite number. Look for infinite parameters or radiance in the scene; no such image is written.", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Column, from the left.
        x: usize,
        /// Row, from the top.
        y: usize,
    },
    /// The file system, or an encoder.
    #[error(transparent)]
    Output(#[from] OutputError),
}
