//! What other engines take: tuned constants, alone or with the shader that they belong to, as text; baked cubes as texture
//! files; what is baked of vertices as streams.
//!
//! - [`target`]: the languages and formats
//! - [`dialect`]: how each language spells what the shader rules say in WGSL
//! - `translate`: the rules' WGSL, in another language
//! - [`provenance`]: where the constants come from
//! - `names`: the prefix of all that an export defines, and its citations
//! - `handed`: textures as arguments, for a language that has no global ones
//! - `idle`: terms without a weight, which no shader need compute
//! - [`cubes`]: baked cubes as KTX2 and DDS; [`vertices`]: what is baked of a mesh, as its attributes
//! - [`unity`]: a folder for Unity's `Assets`, with a material and what it names
//! - `constants`, `function`, `material`: the texts; `passes`: how an engine makes what the function looks up of the UV atlas
//!
//! The shader is written once, as the planner's rules; every exported function is a translation of them.

mod constants;
pub mod cubes;
pub mod dialect;
mod function;
pub mod handed;
mod idle;
mod material;
mod names;
mod passes;
pub mod provenance;
pub mod target;
mod translate;
pub mod vertices;

pub use material::{material, unity};
pub use provenance::Provenance;
pub use target::Target;

use crate::model::effects::{Effects, Form};
use crate::model::gain::Gain;
use crate::model::params::Params;
use crate::shader::{Budget, Facts, PlanError};

/// How far exports may be off: an engine's filtering is the hardware's, whatever its lookups' errors add up to. Its own mesh
/// may be coarse, so that the facts say that silhouettes which are interpolated are off by 1.
pub const BUDGET: Budget = Budget::Within(0.5);

/// What cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The target holds constants alone.
    #[error(
        "{target} holds data, no shader: export the constants alone, or the shader to one of {languages}."
    )]
    NoFunction {
        /// The target's name.
        target: &'static str,
        /// Those that hold one.
        languages: String,
    },
    /// No engine that there are materials for.
    #[error("{target} is no engine that a material can be written for. Take {engines}.")]
    NoMaterial {
        /// The target's name.
        target: &'static str,
        /// Those that are.
        engines: String,
    },
    /// A material has nothing to hand over to the shader.
    #[error(
        "the shader asks for {what}, which no material file hands over. Export the shader alone, and wire it by the words \
         in its head."
    )]
    Unfilled {
        /// What it asks for.
        what: String,
    },
    /// Lookups that the accuracy has the shader filter by itself.
    #[error(
        "within this accuracy the shader filters {resource} by itself, which no export does. Allow a greater error."
    )]
    Filtered {
        /// The cube or map that it looks up.
        resource: &'static str,
    },
    /// No shader within the accuracy.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Constants, and what they belong to.
#[derive(Clone, Copy, Debug)]
pub struct Constants<'a> {
    /// The form of the model.
    pub form: Form,
    /// The effects that read them; others' constants are left out.
    pub effects: Effects,
    /// Their values.
    pub params: &'a Params,
    /// The name of the loss that they minimise, where it is known.
    pub loss: Option<&'a str>,
    /// The factor on each view's image, by the view's name.
    pub gains: &'a [(String, Gain)],
}

impl<'a> Constants<'a> {
    /// Constants of a model, without word of a loss that they minimise or of gains.
    #[must_use]
    pub const fn new(form: Form, effects: Effects, params: &'a Params) -> Self {
        Self { form, effects, params, loss: None, gains: &[] }
    }
}

/// Constants as text. As TOML they are a parameter file, which reads back.
#[must_use]
pub fn constants(target: Target, constants: Constants<'_>, from: &Provenance) -> String {
    constants::text(target, constants, from)
}

/// The shader of a scene with its constants, as text: one function, and what it reads.
///
/// # Errors
/// When the target holds no functions, or no shader is accurate enough.
pub fn function(
    target: Target,
    facts: &Facts,
    params: &Params,
    from: &Provenance,
) -> Result<String, ExportError> {
    function::text(target, facts, params, from)
}
