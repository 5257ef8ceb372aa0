//! Unity: a shader, a material of it, and what Unity keeps beside every asset.
//!
//! - `shader`: the ShaderLab file around the exported include
//! - `saved`: the material, as Unity's editor saves it
//! - `asset`: identities, and how files are imported
//! - `maps`: the scene's maps as pictures that Unity imports
//! - `folder`: all of it, to be written beside the baked cubes

mod asset;
mod folder;
mod maps;
mod saved;
pub(super) mod shader;
#[cfg(test)]
mod tests;

pub use folder::{UnityError, UnityFolder, UnitySkin};

use super::{Parts, names};
use crate::model::params::Param;

/// A constant of the shader, which is a property of its material.
struct Tuned {
    /// The property's name. With an underscore before it, as Unity's own: it meets no function.
    property: String,
    /// What the include calls it.
    name: String,
    /// What it is.
    words: String,
    /// As the shader has it: in 32 bits.
    value: Vec<f32>,
}

impl Tuned {
    /// The numbers of a vector, which always has four in Unity; nothing of a single number.
    fn four(&self) -> Option<[f32; 4]> {
        let number = |i: usize| self.value.get(i).copied().unwrap_or_default();
        (self.value.len() > 1).then(|| std::array::from_fn(number))
    }
}

/// The constants that the include would define by itself.
fn tuned(parts: &Parts<'_>) -> Vec<Tuned> {
    let constant = |(name, _, value): (String, &'static str, Vec<f64>)| {
        let known = name.to_lowercase();
        let words = match Param::from_identifier(&known) {
            Some(param) => param.info().meaning.to_owned(),
            None => known.replace('_', " "),
        };
        let value = value.into_iter().map(|x| x as f32).collect();
        let name = names::constant(&name);
        Tuned { property: format!("_{name}"), name, words, value }
    };
    parts.plan.literals(parts.params).into_iter().map(constant).collect()
}
