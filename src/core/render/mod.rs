//! Images from samples, and image files.
//!
//! - [`antialias`]: samples a pixel
//! - [`backdrop`]: what pictures show behind the mesh
//! - [`shade`]: samples to images, with an image for each term
//! - [`bloom`]: the glow that the haze drives
//! - [`mod@image`]: images in memory
//! - [`files`]: images as EXR and PNG files
//! - [`tonemap`]: from linear radiance to sRGB

pub mod antialias;
pub mod backdrop;
pub mod bloom;
pub mod files;
pub mod image;
pub mod shade;
pub mod tonemap;
