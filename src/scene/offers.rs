//! What a scene file has to offer to effects, whichever of them are on.

use std::path::Path;

use super::animation::{Pose, mesh_file};
use super::error::{SceneError, Warnings};
use super::file::{MapsTable, SceneFile, Source};
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
            normal_map: file.maps.normal.is_some() || own_normals(path, &source, &file)?,
            environment: file.environment.is_some(),
            lights: lights.any(),
        })
    }
}

/// Whether the skin's own material has a normal map that the scene would take.
fn own_normals(path: &Path, source: &Source, file: &SceneFile) -> Result<bool, SceneError> {
    let MapsTable { color, specular, attenuator, material, .. } = &file.maps;
    let named = [color, specular, attenuator].into_iter().any(Option::is_some);
    if !material.unwrap_or(!named) {
        return Ok(false);
    }
    let document = mesh_file(source, file, path.parent().unwrap_or(Path::new("")))?;
    let pose = Pose::check(source, file)?;
    let maps = document.skin_maps(pose.skin(), (true, true), &mut Warnings::new())?;
    Ok(maps.is_some_and(|maps| maps.has_normals()))
}
