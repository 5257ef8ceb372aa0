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
    json::Root::from_slice(text).or_else(|refused| {
        let mut value = serde_json::from_slice(text)?;
        // Otherwise what was refused is refused by the place where it stands in the file.
        if whole(&mut value) { json::Root::from_str(&value.to_string()) } else { Err(refused) }
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

/// Makes integers of floats that are whole, unless they are so large that not every integer is a float. Whether there are any.
fn whole(value: &mut Value) -> bool {
    const EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
    match value {
        // All are looked at: counting does not stop at the first, as `any` would.
        Value::Array(items) => items.iter_mut().map(whole).filter(|changed| *changed).count() > 0,
        Value::Object(fields) => fields.values_mut().map(whole).filter(|changed| *changed).count() > 0,
        Value::Number(number) => {
            let float = number.as_f64().filter(|x| number.is_f64() && x.fract() == 0.0 && x.abs() < EXACT);
            // The sign of a zero is kept.
            let float = float.filter(|x| *x != 0.0 || x.is_sign_positive());
            if let Some(x) = float {
                *number = Number::from(x as i64);
            }
            float.is_some()
        }
        Value::Null | Value::Bool(_) | Value::String(_) => false,
    }
}
