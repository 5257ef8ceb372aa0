//! Forward-mode derivatives of the rules, made from their own WGSL.
//!
//! A rule is a function from quantities to quantities; its *tangent* is the directional derivative: a
//! function of the same arguments and of their tangents. The rules' text is parsed by `naga`, and each requested
//! function is written anew with the chain rule applied to every expression, so that no derivative is kept by hand
//! beside the model that it belongs to. The exceptions are `rules/tangent/*.wgsl`: taken as they are where the chain
//! rule would be right but inaccurate (`normalize_or` divides by the largest component), or MODEL 7 asks for another
//! value at a singular point (`rim_power` at 0, `cube_place_of_unit` of a tiny direction, which `cube_place` may hand
//! it). A long function of numbers alone moves by its partial derivatives, which are the same for all parameters.
//!
//! - [`Tangents`]: the requested functions
//! - `function`: one function's statements; `expression`: the chain rule; `types`: what moves
//! - [`chain`]: the chain rule over a plan's steps

pub mod chain;
mod expression;
mod function;
mod types;

use std::collections::BTreeMap;

use naga::front::wgsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Function, Module, Scalar, TypeInner};

/// Functions whose tangent is taken as it is, with its text. It takes the arguments, then a tangent for each.
const BY_HAND: [(&str, &str); 3] = [
    ("cube_place_of_unit", include_str!("../rules/tangent/cube_place_of_unit.wgsl")),
    ("normalize_or", include_str!("../rules/tangent/normalize_or.wgsl")),
    ("rim_power", include_str!("../rules/tangent/rim_power.wgsl")),
];

/// Expressions from which on a function of numbers is worth partial derivatives.
const LONG: usize = 100;

/// A function that has no tangent.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub enum TangentError {
    /// The text is no WGSL.
    #[error(
        "the rules cannot be read for their derivatives: {0}. This is a fault of skinfit: please report it."
    )]
    Unreadable(String),
    /// No such function.
    #[error(
        "there is no shader function {0} to take the derivative of. This is a fault of skinfit: please report it."
    )]
    Missing(String),
    /// Something that the chain rule is not written for.
    #[error(
        "shader function {function}: {what} has no derivative here. This is a fault of skinfit: please report it."
    )]
    Unsupported {
        /// The function.
        function: String,
        /// The expression or statement.
        what: String,
    },
}

/// Which arguments move: one flag for each of a function's parameters.
type Moving = Vec<bool>;

/// A tangent function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tangent {
    /// Its name. It takes the arguments of the function, then tangents.
    pub name: String,
    /// Whether it takes a tangent of every argument, and not only of those that move.
    pub of_all: bool,
}

/// Tangents of the functions of a WGSL text.
#[derive(Debug)]
pub struct Tangents {
    module: Module,
    info: ModuleInfo,
    /// What was written so far; `None` where the value does not move with those arguments.
    written: BTreeMap<(String, Moving), Option<Tangent>>,
    text: String,
}

impl Tangents {
    /// Of the functions in `source`, a whole module.
    ///
    /// # Errors
    /// When it is not valid.
    pub fn new(source: &str) -> Result<Self, TangentError> {
        let module = wgsl::parse_str(source)
            .map_err(|error| TangentError::Unreadable(error.emit_to_string(source)))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .map_err(|error| TangentError::Unreadable(error.emit_to_string(source)))?;
        Ok(Self { module, info, written: BTreeMap::new(), text: String::new() })
    }

    /// The tangent of `function` when the parameters move whose flag is set. `None`: the value stays.
    ///
    /// # Errors
    /// When there is no such function, or it does what the chain rule is not written for.
    pub fn of(&mut self, function: &str, moving: &[bool]) -> Result<Option<Tangent>, TangentError> {
        if !moving.contains(&true) {
            return Ok(None);
        }
        let by_hand = BY_HAND.iter().find(|(name, _)| *name == function);
        let key = (function.to_owned(), if by_hand.is_some() { Vec::new() } else { moving.to_vec() });
        if let Some(written) = self.written.get(&key) {
            return Ok(written.clone());
        }
        let written = if let Some((_, text)) = by_hand {
            self.text.push('\n');
            self.text.push_str(text);
            Some(Tangent { name: format!("{function}_tangent"), of_all: true })
        } else {
            let found = self.module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(function));
            let (handle, _) = found.ok_or_else(|| TangentError::Missing(function.to_owned()))?;
            function::write(self, handle, moving)?.map(|text| {
                self.text.push_str(&text);
                Tangent { name: name(function, moving), of_all: false }
            })
        };
        self.written.insert(key, written.clone());
        Ok(written)
    }

    /// Whether a function is a number made of numbers in many operations, as quotients of polynomials are.
    fn has_partials(&self, function: &Function) -> bool {
        let number = |ty| matches!(self.module.types[ty].inner, TypeInner::Scalar(Scalar::F32));
        let by_hand = BY_HAND.iter().any(|(name, _)| function.name.as_deref() == Some(name));
        !by_hand
            && function.expressions.len() >= LONG
            && function.arguments.iter().all(|argument| number(argument.ty))
            && function.result.as_ref().is_some_and(|result| number(result.ty))
    }

    /// The functions' text, each after those that it calls.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// The name of a tangent: which arguments move is told by letters, as several may be needed.
fn name(function: &str, moving: &[bool]) -> String {
    let flags: String = moving.iter().map(|&moves| if moves { 'd' } else { 'c' }).collect();
    format!("{function}_{flags}")
}
