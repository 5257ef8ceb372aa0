//! Where a view's camera stands.

use std::path::Path;

use glam::{DMat3, DMat4, DVec3};
use toml::Spanned;

use crate::error::{SceneError, Warnings, warn};
use crate::file::{Source, ViewTable};
use crate::gltf::{Document, FileCamera};
use crate::suggestion;
use crate::view::looking;

/// Where a camera stands.
pub(super) enum Place<'a> {
    /// World to camera.
    World(DMat4),
    /// As the mesh file's camera of this name.
    Named(&'a Spanned<String>),
}

impl<'a> Place<'a> {
    /// By the one of three ways that a table gives.
    pub(super) fn of(source: &Source, table: &'a ViewTable) -> Result<Self, SceneError> {
        let ways = [
            ("world_to_camera", table.world_to_camera.is_some()),
            ("look_at", table.eye.is_some() || table.look_at.is_some() || table.up.is_some()),
            ("camera", table.camera.is_some()),
        ];
        let given: Vec<&str> = ways.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect();
        let view = table.name.get_ref();
        let either = "Give world_to_camera, or eye and look_at, or camera: a name in the mesh file";
        match given.as_slice() {
            [_] => {}
            [] => return Err(source.error(&table.name, format!("the view `{view}` has no camera"), either)),
            several => {
                let what = format!("the view `{view}` has {}", several.join(" and "));
                return Err(source.error(&table.name, what, either));
            }
        }
        if let Some(name) = &table.camera {
            return Ok(Self::Named(name));
        }
        match (&table.world_to_camera, &table.eye, &table.look_at) {
            (Some(matrix), ..) => rigid(source, matrix).map(Self::World),
            (None, Some(eye), Some(target)) => {
                look_at(source, eye, target, table.up.as_ref()).map(Self::World)
            }
            (None, eye, _) => {
                let missing = if eye.is_some() { "look_at" } else { "eye" };
                let what = format!("the view `{view}` has no {missing}");
                Err(source.error(&table.name, what, "Give both eye and look_at, each [x, y, z]"))
            }
        }
    }
}

/// The cameras of a mesh file, as they stand at a time.
#[derive(Clone, Copy)]
pub(crate) struct MeshCameras<'a> {
    pub document: &'a Document,
    /// Seconds into the animation.
    pub time: Option<f64>,
}

impl MeshCameras<'_> {
    /// The camera that a scene file names, and its world to camera.
    pub(super) fn named(
        self,
        source: &Source,
        name: &Spanned<String>,
    ) -> Result<(FileCamera, DMat4), SceneError> {
        let cameras = self.document.cameras(self.time)?;
        let wanted = name.get_ref();
        let (found, others): (Vec<_>, Vec<_>) =
            cameras.into_iter().partition(|camera| camera.name == *wanted);
        let file = self.document.path().display();
        match <[FileCamera; 1]>::try_from(found) {
            Ok([camera]) => match camera.world_to_camera {
                Some(world_to_camera) => Ok((camera, world_to_camera)),
                None => {
                    let what = format!(
                        "{file} has the camera `{wanted}` at a node that mirrors, shears or has no size"
                    );
                    Err(source.error(name, what, "Apply the node's scale there, and export it anew"))
                }
            },
            Err(found) if found.is_empty() => {
                let known: Vec<&str> = others.iter().map(|camera| camera.name.as_str()).collect();
                let what = format!("{file} has no camera `{wanted}`");
                Err(source.error(name, what, suggestion(wanted, &known)))
            }
            Err(found) => {
                let what = format!("{file} has {} cameras `{wanted}`", found.len());
                Err(source.error(name, what, "Give each a name of its own there"))
            }
        }
    }
}

impl FileCamera {
    /// Warn where the view has other proportions than the file's camera: its height is kept.
    pub(super) fn tell_aspect(
        &self,
        view: &Spanned<String>,
        [width, height]: [u32; 2],
        warnings: &mut Warnings,
        path: &Path,
    ) {
        let Some(aspect) = self.aspect else { return };
        let own = f64::from(width) / f64::from(height);
        // Half a pixel at the border of an image that is 50 pixels wide.
        if (own / aspect - 1.0).abs() > 0.01 {
            let (view, name) = (view.get_ref(), &self.name);
            let message = format!(
                "the view `{view}` is {own:.3} times as wide as high, and the mesh file's camera {name:?} {aspect:.3} \
                 times: what it sees from top to bottom is kept"
            );
            warn(warnings, path, message);
        }
    }
}

/// A camera at `eye` that looks at `target`; what is along `up` (the world's +Y) is upright in its image.
fn look_at(
    source: &Source,
    eye: &Spanned<[f64; 3]>,
    target: &Spanned<[f64; 3]>,
    up: Option<&Spanned<[f64; 3]>>,
) -> Result<DMat4, SceneError> {
    let points = [("eye", Some(eye)), ("look_at", Some(target)), ("up", up)];
    for (name, point) in points.into_iter().filter_map(|(name, point)| point.map(|point| (name, point))) {
        let refuse =
            |what: String| source.error(point, format!("{name} {what}"), "Give three finite numbers");
        all_finite(point.get_ref(), 3).map_err(refuse)?;
    }
    let (from, to) = (DVec3::from(*eye.get_ref()), DVec3::from(*target.get_ref()));
    let Some(direction) = (to - from).try_normalize() else {
        let what = "eye and look_at are the same place";
        return Err(source.error(target, what, "Give a place in front of the camera"));
    };
    let upright = up.map_or(DVec3::Y, |up| DVec3::from(*up.get_ref()));
    let across = upright.try_normalize().map_or(DVec3::ZERO, |up| direction.cross(up));
    // Below this angle, in radians, the image's turn is what roundings make of it.
    if across.length() < 1e-6 {
        let place = up.unwrap_or(target);
        let what = "up has no length, or lies along the way that the camera looks";
        return Err(source.error(
            place,
            what,
            "Give an up = [x, y, z] across it; without, it is the world's +Y",
        ));
    }
    Ok(looking(from, direction, upright.normalize()))
}

/// The matrix of 16 numbers, row by row, which must move without scaling, shearing or mirroring.
fn rigid(source: &Source, value: &Spanned<Vec<f64>>) -> Result<DMat4, SceneError> {
    let refuse = |what: String| {
        source.error(
            value,
            format!("world_to_camera {what}"),
            "Give 16 finite numbers, row by row: a rotation, a translation in the last column, and 0, 0, 0, 1",
        )
    };
    let numbers = value.get_ref();
    let Ok(rows) = <[f64; 16]>::try_from(numbers.as_slice()) else {
        return Err(refuse(format!("has {} numbers instead of 16", numbers.len())));
    };
    all_finite(&rows, 4).map_err(refuse)?;
    let matrix = DMat4::from_cols_array(&rows).transpose();
    turns_alone(DMat3::from_mat4(matrix)).map_err(|what| refuse(what.into()))?;
    if (matrix.row(3) - glam::DVec4::W).abs().max_element() > 1e-9 {
        return Err(refuse("has a last row other than 0, 0, 0, 1 (is it stored by columns?)".into()));
    }
    Ok(matrix)
}

/// Say where a matrix of `columns` columns holds what is not finite.
pub(crate) fn all_finite(rows: &[f64], columns: usize) -> Result<(), String> {
    match rows.iter().position(|number| !number.is_finite()) {
        Some(i) => Err(format!("holds {} at row {}, column {}", rows[i], i / columns, i % columns)),
        None => Ok(()),
    }
}

/// Say how a matrix is no rotation.
pub(crate) fn turns_alone(rotation: DMat3) -> Result<(), &'static str> {
    // Files round to a few digits; beyond 1e-3 the image would be visibly sheared.
    let close = |a: DVec3, b: DVec3| (a - b).abs().max_element() <= 1e-3;
    let gram = rotation.transpose() * rotation;
    if !(close(gram.x_axis, DVec3::X) && close(gram.y_axis, DVec3::Y) && close(gram.z_axis, DVec3::Z)) {
        return Err("scales or shears: its rotation part is not orthonormal to 1e-3");
    }
    if rotation.determinant() < 0.0 {
        return Err("mirrors: its rotation part is left-handed");
    }
    Ok(())
}
