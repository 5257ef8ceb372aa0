//! The `[[view]]` tables: names, cameras and the files that belong to them, checked.

use std::path::PathBuf;

use glam::{DMat3, DMat4, DVec3};
use toml::Spanned;

use super::error::SceneError;
use super::file::{BackgroundValue, Source, ViewTable};
use super::numbers::{interval, number, short};
use super::view::{Background, Camera};
use crate::model::params::LARGEST;

/// Degrees; seen through less, the rays of a thousand pixels are no longer a hundred different f32.
const NARROWEST_FOV: f64 = 1e-3;
/// The most pixels along a side of a view.
const LARGEST_SIDE: i64 = 16384;

/// A view before its images are read.
pub(super) struct ViewPlan {
    pub name: String,
    pub camera: Camera,
    pub target: Option<PathBuf>,
    pub mask: Option<PathBuf>,
    pub haze: Option<PathBuf>,
    pub background: Background,
}

/// All views of a scene; there must be one.
pub(super) fn plan(source: &Source, tables: &[Spanned<ViewTable>]) -> Result<Vec<ViewPlan>, SceneError> {
    if tables.is_empty() {
        return Err(SceneError::new(
            &source.path,
            "has no view",
            "Add a [[view]] with name, world_to_camera, fov_y_degrees, width and height",
        ));
    }
    let mut plans: Vec<ViewPlan> = Vec::new();
    for table in tables.iter().map(Spanned::get_ref) {
        let name = file_name(source, &table.name)?;
        // Some file systems do not tell cases apart.
        if plans.iter().any(|plan| plan.name.to_lowercase() == name.to_lowercase()) {
            return Err(source.error(
                &table.name,
                format!("two views are named `{name}`"),
                "Give each view a name of its own (case does not count)",
            ));
        }
        plans.push(ViewPlan {
            name,
            camera: camera(source, table)?,
            target: table.target.clone(),
            mask: table.mask.clone(),
            haze: table.haze.clone(),
            background: background(source, table.background.as_ref())?,
        });
    }
    check_haze(source, tables)?;
    Ok(plans)
}

/// Haze is compared in every view that has a target, or in none: a fit has one set of channels.
fn check_haze(source: &Source, tables: &[Spanned<ViewTable>]) -> Result<(), SceneError> {
    let targets = || tables.iter().map(Spanned::get_ref).filter(|table| table.target.is_some());
    let with = targets().find(|table| table.haze.is_some());
    let without = targets().find(|table| table.haze.is_none());
    match (with, without) {
        (Some(with), Some(without)) => Err(source.error(
            &without.name,
            format!(
                "the view `{}` has a target but names no haze, and the view `{}` does",
                without.name.get_ref(),
                with.name.get_ref()
            ),
            "Give every view that has a target a haze, or none",
        )),
        _ => Ok(()),
    }
}

/// What stands behind the mesh.
fn background(source: &Source, value: Option<&Spanned<BackgroundValue>>) -> Result<Background, SceneError> {
    let Some(value) = value else { return Ok(Background::None) };
    match value.get_ref() {
        BackgroundValue::Name(name) => {
            let name = Spanned::new(value.span(), name.clone());
            let known = [("none", Background::None), ("environment", Background::Environment)];
            source.choose("background", &name, &known)
        }
        BackgroundValue::Color(rgb) => match rgb.iter().find(|c| !(0.0..=LARGEST).contains(*c)) {
            None => Ok(Background::Color(*rgb)),
            Some(&c) => Err(source.error(
                value,
                format!("background holds {}", short(c)),
                format!("Give three linear radiances in {}", interval(0.0, LARGEST)),
            )),
        },
    }
}

/// A view's name becomes part of file names.
fn file_name(source: &Source, name: &Spanned<String>) -> Result<String, SceneError> {
    let text = name.get_ref();
    let safe = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
    let good = !text.is_empty()
        && text.len() <= 64
        && text.chars().all(safe)
        && text.chars().next().is_some_and(|c| c.is_alphanumeric() || c == '_')
        && !text.ends_with('.');
    if good {
        return Ok(text.clone());
    }
    Err(source.error(
        name,
        format!("the view's name {text:?} cannot be part of a file name"),
        "Use up to 64 letters, digits, `_`, `-` and `.`, beginning with a letter or digit",
    ))
}

fn camera(source: &Source, table: &ViewTable) -> Result<Camera, SceneError> {
    let wanted = format!("degrees from {NARROWEST_FOV} to below 180");
    let fov = number(source, Some(&table.fov_y_degrees), 0.0, "fov_y_degrees", &wanted, |f| {
        (NARROWEST_FOV..180.0).contains(&f)
    })?;
    Ok(Camera {
        world_to_camera: rigid(source, &table.world_to_camera)?,
        fov_y: fov.to_radians(),
        width: side(source, &table.width, "width")?,
        height: side(source, &table.height, "height")?,
    })
}

fn side(source: &Source, value: &Spanned<i64>, name: &str) -> Result<u32, SceneError> {
    let pixels = *value.get_ref();
    match u32::try_from(pixels) {
        Ok(size) if (1..=LARGEST_SIDE).contains(&pixels) => Ok(size),
        _ => Err(source.error(
            value,
            format!("{name} = {pixels} is out of bounds"),
            format!("Give a number of pixels in [1, {LARGEST_SIDE}]"),
        )),
    }
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

/// Say where a matrix of so many columns holds what is not finite.
pub(super) fn all_finite(rows: &[f64], columns: usize) -> Result<(), String> {
    match rows.iter().position(|number| !number.is_finite()) {
        Some(i) => Err(format!("holds {} at row {}, column {}", rows[i], i / columns, i % columns)),
        None => Ok(()),
    }
}

/// Say how a matrix is no rotation.
pub(super) fn turns_alone(rotation: DMat3) -> Result<(), &'static str> {
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
