//! The files of texture maps that a scene names.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::error::{SceneError, Warnings, warn};
use super::file::{MapsTable, SceneFile, Source};
use super::images;
use super::maps::{Map, Maps, OwnMap};
use crate::model::fields::{Field, Fields};
use crate::model::needs::Needs;

/// The maps of `[maps]` that the enabled effects ask for; those of fields that the scene's terms have `declared`.
///
/// # Errors
/// When a file is missing or damaged, or a map is named that no term declares.
pub(super) fn read_maps(
    source: &Source,
    file: &SceneFile,
    folder: &Path,
    (needs, declared): (Needs, Fields),
    warnings: &mut Warnings,
) -> Result<Maps, SceneError> {
    let maps = &file.maps;
    let flip = normal_flip(source, file)?;
    let wanted =
        |path: &Option<PathBuf>, need: bool| path.as_ref().filter(|_| need).map(|path| folder.join(path));
    let (color, normal) = (wanted(&maps.color, needs.color_map), wanted(&maps.normal, needs.normal_map));
    let specular = wanted(&maps.specular, needs.specular_map);
    let attenuator = wanted(&maps.attenuator, needs.attenuator_map);
    // The paper keeps the side-specular intensity in the normal map's alpha (listing 3-4).
    let packed = wanted(&maps.normal, needs.specular_map && maps.specular.is_none());
    let mut told = Vec::new();
    let ((color, normals), (specular, attenuator)) = rayon::join(
        || {
            let normals = normal.as_ref().or(packed.as_ref());
            (
                color.map(|path| images::color_map(&path, &mut told)).transpose(),
                normals.map(|path| images::normal_map(path, flip)).transpose(),
            )
        },
        || {
            (
                specular.map(|path| images::scalar_map(&path)).transpose(),
                attenuator.map(|path| images::scalar_map(&path)).transpose(),
            )
        },
    );
    warnings.append(&mut told);
    let (color, normals, attenuator) = (color?, normals?, attenuator?);
    let (normals, alpha) = normals.map_or((None, None), |(map, alpha)| (Some(map), alpha));
    let specular = match (specular?, packed, alpha) {
        (None, Some(path), Some(alpha)) => packed_specular(&path, alpha, warnings),
        (specular, ..) => specular,
    };
    let own = read_own_maps(source, maps, folder, (needs, declared), warnings)?;
    let normals = normal.zip(normals).map(|(path, normals)| {
        warn_of_other_than_normals(&path, &normals, warnings);
        normals
    });
    Ok(Maps { color, normal: normals, specular, attenuator, own, ..Maps::default() })
}

/// Tells of a normal map that looks like another picture, a photograph say.
pub(super) fn warn_of_other_than_normals(path: &Path, map: &Map<3>, warnings: &mut Warnings) {
    // Filtered, compressed and worn maps have some texels that are far from unit vectors, not a quarter of them.
    const MOST: f64 = 0.25;
    let (mut count, mut others, mut mean) = (0_u64, 0_u64, DVec3::ZERO);
    // Around charts there may be nothing.
    for texel in map.texels.iter().filter(|texel| **texel != [0.0; 3]) {
        let normal = 2.0 * DVec3::from(texel.map(f64::from)) - 1.0;
        (count, mean) = (count + 1, mean + normal);
        others += u64::from(normal.z <= 0.0 || !(0.7..1.3).contains(&normal.length()));
    }
    let share = others as f64 / count.max(1) as f64;
    let why = if count == 0 {
        "it is black".to_owned()
    } else if share > MOST {
        format!("{:.0}% of its texels are far from unit vectors that point out of the surface", 100.0 * share)
    } else if mean.truncate().length() > mean.z {
        // Bumps lean to all sides. Bright colours are unit vectors, too, which lean to one.
        "its vectors lean to one side by more than 45 degrees on average".to_owned()
    } else {
        return;
    };
    let message =
        format!("does not look like a normal map: {why}. Name a tangent-space map as `normal` in [maps]");
    warn(warnings, path, message);
}

/// The maps of fields that the scene's terms have `declared`, those alone that the enabled effects ask for.
fn read_own_maps(
    source: &Source,
    maps: &MapsTable,
    folder: &Path,
    (needs, declared): (Needs, Fields),
    warnings: &mut Warnings,
) -> Result<Vec<(Field, OwnMap)>, SceneError> {
    let mut own = Vec::new();
    for (name, path) in &maps.own {
        let Some(field) = declared.named(name.get_ref()) else {
            let known: Vec<&str> = declared.iter().map(Field::name).collect();
            let what = format!("[maps.own] has {}, which no term of the scene declares", name.get_ref());
            let remedy = match known.as_slice() {
                [] => "Declare it in a file of `terms` by a line `// map: NAME: TYPE = NEUTRAL; what it is`"
                    .to_owned(),
                known => format!("The terms' maps are {}", known.join(", ")),
            };
            return Err(source.error(name, what, remedy));
        };
        if !needs.fields.has(field) {
            continue;
        }
        let path = folder.join(path);
        let map = match field.info().numbers {
            1 => OwnMap::Scalar(images::scalar_map(&path)?),
            _ => OwnMap::Color(images::color_map(&path, warnings)?),
        };
        own.push((field, map));
    }
    Ok(own)
}

/// The specular map that a normal map's alpha holds; none where that is 1 everywhere, as in files that only have
/// the channel.
fn packed_specular(path: &Path, alpha: Map<1>, warnings: &mut Warnings) -> Option<Map<1>> {
    let ends = |(low, high): (f32, f32), &[a]: &[f32; 1]| (low.min(a), high.max(a));
    let (low, high) = alpha.texels.iter().fold((f32::INFINITY, f32::NEG_INFINITY), ends);
    if (low, high) == (1.0, 1.0) {
        return None;
    }
    let message = format!(
        "its alpha, {low:.3} to {high:.3}, is taken as the specular map, which the scene does not name: \
         `specular` in [maps] names another"
    );
    warn(warnings, path, message);
    Some(alpha)
}

/// Whether the normal map's Y is to be turned.
pub(super) fn normal_flip(source: &Source, file: &SceneFile) -> Result<bool, SceneError> {
    match &file.maps.normal_y {
        Some(name) => source.choose("direction", name, &[("up", false), ("down", true)]),
        None => Ok(false),
    }
}
