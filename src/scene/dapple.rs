//! `[environment] dapple`: the listing's `DappleXf`, in the environment's frame.

use glam::{DMat3, DVec3};
use toml::Spanned;

use super::cameras::{all_finite, turns_alone};
use super::error::SceneError;
use super::file::Source;
use crate::model::dapple::Dapple;

/// The dapple of a scene whose environment is turned by `degrees` about +Y. Without a matrix it is the identity in
/// the world: scenes that do not say where light falls through leaves from look the same however they are turned.
pub(super) fn dapple(
    source: &Source,
    value: Option<&Spanned<Vec<f64>>>,
    degrees: f64,
) -> Result<Dapple, SceneError> {
    let Some(value) = value else { return Ok(Dapple::LEAVES_AHEAD) };
    Ok(Dapple::new(third_row(source, value)?.to_array(), degrees, false))
}

/// The third row of a rotation of 9 or 16 numbers, row by row: all of it that is read. A normal knows no translation,
/// so that there must be none.
fn third_row(source: &Source, value: &Spanned<Vec<f64>>) -> Result<DVec3, SceneError> {
    let refuse = |what: String| {
        source.error(
            value,
            format!("dapple {what}"),
            "Give a rotation, row by row: 9 finite numbers, or 16 with 0, 0, 0, 1 in the last row and column",
        )
    };
    let numbers = value.get_ref();
    let side = match numbers.len() {
        9 => 3,
        16 => 4,
        count => return Err(refuse(format!("has {count} numbers instead of 9 or 16"))),
    };
    all_finite(numbers, side).map_err(refuse)?;
    let row = |i: usize| DVec3::new(numbers[side * i], numbers[side * i + 1], numbers[side * i + 2]);
    turns_alone(DMat3::from_cols(row(0), row(1), row(2)).transpose()).map_err(|what| refuse(what.into()))?;
    let border = (0..numbers.len()).filter(|i| i / side == 3 || i % side == 3);
    let unit = |i: usize| if i == 15 { 1.0 } else { 0.0 };
    if border.into_iter().any(|i| (numbers[i] - unit(i)).abs() > 1e-9) {
        return Err(refuse("moves or projects: its last row and column are not 0, 0, 0, 1".into()));
    }
    Ok(row(2).normalize())
}
