//! Images from samples, and image files.
//!
//! - [`antialias`]: samples a pixel
//! - [`backdrop`]: what pictures show behind the mesh
//! - [`shade`]: samples to images, with an image for each term; [`mod@format`]: in other number formats
//! - [`bloom`]: the glow that the haze drives
//! - [`mod@image`]: images in memory
//! - [`files`]: images as EXR and PNG files; `error`: why one cannot be written
//! - [`shading`]: where the renderer shades
//! - [`places`]: where the surface behind each pixel lies
//! - [`tonemap`]: from linear radiance to sRGB

pub mod antialias;
pub mod backdrop;
pub mod bloom;
mod error;
pub mod files;
pub mod format;
pub mod image;
pub mod places;
pub mod shade;
pub mod shading;
pub mod tonemap;
