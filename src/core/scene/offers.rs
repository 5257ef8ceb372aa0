//! What a scene file has to offer to effects, whichever of them are on.

use std::path::Path;

use super::error::SceneError;
use super::file::{SceneFile, Source};
use super::lit::Lights;

/// What a scene file names that effects are about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Offers {
    /// A normal map.
    pub normal_map: bool,
    /// An environment.
    pub environment: bool,
    /// Lights of its own, of its mesh file, or taken out of the panorama.
    pub lights: bool,
}

impl Offers {
    /// Read a scene file, and no more of what it names than its lights.
    ///
    /// # Errors
    /// When it cannot be read, or its lights make no sense.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let source = Source::read(path)?;
        let file: SceneFile = source.parse()?;
        let lights = Lights::of_file(&source, &file)?;
        Ok(Self {
            normal_map: file.maps.normal.is_some(),
            environment: file.environment.is_some(),
            lights: lights.any(),
        })
    }
}
