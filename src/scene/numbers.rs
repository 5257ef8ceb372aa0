//! Numbers of scene files: how they are written, and whether they are within their bounds.

use toml::Spanned;

use super::error::SceneError;
use super::file::Source;

/// A number as one would write it: 180, 1e300.
pub fn short(number: f64) -> String {
    let text = format!("{number:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// A number to `digits` digits, as one would write it.
#[must_use]
pub fn digits(x: f64, digits: i32) -> String {
    // Without a sign.
    if x == 0.0 {
        return "0".to_owned();
    }
    if !x.is_finite() {
        return short(x);
    }
    let unit = 10.0_f64.powi((digits - 1).saturating_sub(x.abs().log10().floor() as i32).clamp(-300, 300));
    let rounded = (x * unit).round() / unit;
    short(if rounded == 0.0 { 0.0 } else { rounded })
}

/// "[0, inf)" and the like.
#[must_use]
pub fn interval(lower: f64, upper: f64) -> String {
    let left = if lower.is_finite() { '[' } else { '(' };
    let right = if upper.is_finite() { ']' } else { ')' };
    format!("{left}{lower}, {upper}{right}")
}

/// A whole number within bounds, or `default` when it is not given.
pub(super) fn whole(
    source: &Source,
    value: Option<&Spanned<i64>>,
    name: &str,
    [least, most]: [i64; 2],
    default: u32,
) -> Result<u32, SceneError> {
    let Some(number) = value else { return Ok(default) };
    u32::try_from(*number.get_ref()).ok().filter(|&n| (least..=most).contains(&i64::from(n))).ok_or_else(
        || {
            let what = format!("{name} = {} is out of bounds", number.get_ref());
            source.error(number, what, format!("Give a whole number in [{least}, {most}]"))
        },
    )
}

/// A number that must be finite and satisfy `test`, or `default` when it is not given.
pub(super) fn number(
    source: &Source,
    value: Option<&Spanned<f64>>,
    default: f64,
    name: &str,
    wanted: &str,
    test: impl Fn(f64) -> bool,
) -> Result<f64, SceneError> {
    let Some(spanned) = value else { return Ok(default) };
    let number = *spanned.get_ref();
    if number.is_finite() && test(number) {
        return Ok(number);
    }
    Err(source.error(
        spanned,
        format!("{name} = {} is out of bounds", short(number)),
        format!("Give {wanted}"),
    ))
}
