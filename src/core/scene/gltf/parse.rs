//! A file's JSON as the crate's types.

use gltf::json;
use serde_json::{Error, Number, Value};

/// The file's JSON. Whole numbers may be written as floats, as the standard has it ("1.0", section 2.7): the crate refuses
/// them, so what it refuses is read once more with these as integers.
///
/// # Errors
///
/// If it is no JSON, or not glTF's.
pub(super) fn root(text: &[u8]) -> Result<json::Root, Error> {
    json::Root::from_slice(text).or_else(|refused| match value(text)?.to_string() {
        mended if mended.as_bytes() != text => json::Root::from_str(&mended),
        _ => Err(refused),
    })
}

/// The file's JSON as it stands, whole numbers as integers.
///
/// # Errors
///
/// If it is no JSON.
pub(super) fn value(text: &[u8]) -> Result<Value, Error> {
    let mut value = serde_json::from_slice(text)?;
    whole(&mut value);
    Ok(value)
}

/// Makes integers of floats that are whole and that hold every integer as large as they are.
fn whole(value: &mut Value) {
    const EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
    match value {
        Value::Array(items) => items.iter_mut().for_each(whole),
        Value::Object(fields) => fields.values_mut().for_each(whole),
        Value::Number(number) => {
            let float = number.as_f64().filter(|x| number.is_f64() && x.fract() == 0.0 && x.abs() < EXACT);
            // The sign of a zero is kept.
            if let Some(x) = float.filter(|x| *x != 0.0 || x.is_sign_positive()) {
                *number = Number::from(x as i64);
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}
