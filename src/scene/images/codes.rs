//! A photograph as its camera wrote it, for those who find out what light its codes stand for.

use std::path::Path;

use super::read;
use crate::error::SceneError;

/// Codes of 8 or 16 bits, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Codes {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each pixel.
    pub rgb: Vec<[u16; 3]>,
    /// The greatest that a code may be.
    pub most: u16,
}

/// The codes of a PNG or JPEG file. What it says of their colours is not looked at.
///
/// # Errors
/// When it cannot be read as an image, or holds radiance.
pub fn codes(path: &Path) -> Result<Codes, SceneError> {
    let image = read(path, None)?;
    let Some(most) = image.code else {
        let remedy = "Give photographs as PNG or JPEG, of 8 or 16 bits";
        return Err(SceneError::new(path, "holds radiance, which is merged already", remedy));
    };
    // Shares in f32 tell 16 bits apart.
    let code = |share: f32| (f64::from(share) * f64::from(most)).round() as u16;
    let rgb = image.rgb.iter().map(|rgb| rgb.map(code)).collect();
    Ok(Codes { width: image.width, height: image.height, rgb, most })
}
