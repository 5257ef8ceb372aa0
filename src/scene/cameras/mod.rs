//! The `[[view]]` tables: names, cameras and the files that belong to them, checked.
//!
//! - `lens`: what bends its image
//! - `place`: where a camera stands: by a matrix, by what it looks at, or by its name in the mesh file

mod lens;
mod place;

use std::path::PathBuf;

use glam::DMat4;
use toml::Spanned;

pub(super) use self::lens::{LARGEST_COEFFICIENT, MOST_RATIO, first_unlit};
pub(super) use self::place::{MeshCameras, all_finite, turns_alone};

use self::lens::{check_coefficients, with_lens};
use self::place::Place;
use super::error::{SceneError, Warnings};
use super::file::{BackgroundValue, ResponseValue, Source, ViewTable};
use super::numbers::{interval, number, short};
use super::view::{Background, Camera};
use crate::model::params::LARGEST;

/// Degrees; seen through less, the rays of a thousand pixels are no longer a hundred different f32.
pub(super) const NARROWEST_FOV: f64 = 1e-3;
/// The most pixels along a side of a view.
pub(super) const LARGEST_SIDE: i64 = 16384;

/// The greatest power of a response: of a steeper one all codes but the highest are dark.
const STEEPEST: f64 = 10.0;

/// A view before its images are read.
pub(super) struct ViewPlan {
    pub name: String,
    pub camera: Camera,
    pub target: Option<PathBuf>,
    pub mask: Option<PathBuf>,
    pub haze: Option<PathBuf>,
    pub response: Option<ResponseValue>,
    pub background: Background,
}

/// All views of a scene; there must be one. Without a mesh file, cameras that are named stand anywhere.
pub(super) fn plan(
    source: &Source,
    tables: &[Spanned<ViewTable>],
    mesh: Option<MeshCameras<'_>>,
    warnings: &mut Warnings,
) -> Result<Vec<ViewPlan>, SceneError> {
    if tables.is_empty() {
        return Err(SceneError::new(
            &source.path,
            "has no view",
            "Add a [[view]] with name, eye, look_at, fov_y_degrees, width and height",
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
            camera: camera(source, table, mesh, warnings)?,
            target: table.target.clone(),
            mask: table.mask.clone(),
            haze: table.haze.clone(),
            response: response(source, table.response.as_ref())?,
            background: background(source, table.background.as_ref())?,
        });
    }
    check_haze(source, tables)?;
    Ok(plans)
}

/// What a view says of its camera's response, the file of a table not read.
fn response(
    source: &Source,
    value: Option<&Spanned<ResponseValue>>,
) -> Result<Option<ResponseValue>, SceneError> {
    let Some(value) = value else { return Ok(None) };
    match value.get_ref() {
        ResponseValue::Gamma(gamma) if !(gamma.is_finite() && *gamma > 0.0 && *gamma <= STEEPEST) => {
            Err(source.error(
                value,
                format!("response = {gamma} is no power"),
                format!(
                    "Give the power of a code that light is, above 0 and at most {STEEPEST}, such as 2.2"
                ),
            ))
        }
        known => Ok(Some(known.clone())),
    }
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

fn camera(
    source: &Source,
    table: &ViewTable,
    mesh: Option<MeshCameras<'_>>,
    warnings: &mut Warnings,
) -> Result<Camera, SceneError> {
    let (width, height) = (side(source, &table.width, "width")?, side(source, &table.height, "height")?);
    let wanted = format!("degrees from {NARROWEST_FOV} to below 180");
    let within = |degrees: f64| (NARROWEST_FOV..180.0).contains(&degrees);
    let degrees = number(source, table.fov_y_degrees.as_ref(), 0.0, "fov_y_degrees", &wanted, within)?;
    let given = table.fov_y_degrees.is_some().then(|| degrees.to_radians());
    let (world_to_camera, own) = match Place::of(source, table)? {
        Place::World(matrix) => (matrix, None),
        Place::Named(name) => match mesh {
            Some(mesh) => {
                let (camera, world_to_camera) = mesh.named(source, name)?;
                camera.tell_aspect(&table.name, [width, height], warnings, &source.path);
                (world_to_camera, Some(camera.fov_y))
            }
            // The values alone are checked; what a lens shows hangs on the field of view.
            None if given.is_none() => {
                let camera = Camera::pinhole(DMat4::IDENTITY, 1.0, [width, height]);
                check_coefficients(source, table)?;
                return Ok(camera);
            }
            None => (DMat4::IDENTITY, None),
        },
    };
    let fov_y = given.or(own).ok_or_else(|| {
        let what = format!("the key `fov_y_degrees` is missing in the view `{}`", table.name.get_ref());
        source.error(&table.name, what, format!("Give {wanted}: the vertical field of view"))
    })?;
    if !within(fov_y.to_degrees()) {
        let what = format!("the camera has a field of view of {} degrees", short(fov_y.to_degrees()));
        return Err(source.error(&table.name, what, format!("Give fov_y_degrees, {wanted}")));
    }
    let camera = Camera::pinhole(world_to_camera, fov_y, [width, height]);
    with_lens(source, table, camera)
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
