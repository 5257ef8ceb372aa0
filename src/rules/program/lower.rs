//! The rules' WGSL as a graph: functions are called in place, branches become choices.
//!
//! - lookups in faces are one call (`sample_faces` of `rules/lib/cube.wgsl`, and its tangent), as their texels are
//!   addressed by whole numbers, which graphs have not; `is_finite` likewise
//! - so are unit vectors and places on cubes ([`super::native`]), which every fragment needs again and again
//! - both sides of an `if` are computed, and a value chosen where they meet: the rules' branches are short
//!
//! Here stand the text and its functions; one call of one is a `frame`, its parts are `expression`, `math`, `call` (of
//! other functions) and `memory` (where pointers lead).

mod call;
mod expression;
mod frame;
mod math;
mod memory;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Function, Handle, Module, TypeInner};

use self::frame::Frame;
use super::graph::{Graph, Id};

/// What the name of a field begins with that holds how far another goes from a texel to its right neighbour (`dpdx`).
pub const STEP_ALONG_U: &str = "dpdx_";
/// The same, to the texel below (`dpdy`).
pub const STEP_ALONG_V: &str = "dpdy_";

/// A text that cannot be lowered.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub enum LowerError {
    /// It is no valid WGSL.
    #[error("the rules cannot be read: {0}")]
    Unreadable(String),
    /// No such function.
    #[error("there is no shader function {0}")]
    Missing(String),
    /// Something that graphs of numbers do not have.
    #[error(
        "shader function {function}: {what} cannot be computed on the processor; write it by arithmetic, comparisons and `if`"
    )]
    Unsupported {
        /// The function.
        function: String,
        /// The expression or statement.
        what: String,
    },
}

/// A value while functions are lowered.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number, a vector's components, or a structure's numbers member after member.
    Numbers(Vec<Id>),
    /// A texture, by its name.
    Texture(String),
}

impl Value {
    fn numbers(self) -> Option<Vec<Id>> {
        match self {
            Self::Numbers(ids) => Some(ids),
            Self::Texture(_) => None,
        }
    }
}

/// What becomes of functions that can be one instruction ([`super::native`]); lookups always are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Natives {
    /// They are one: the fastest.
    Called,
    /// They are operations, as the rules write them: so that each can be rounded.
    Written,
}

/// A WGSL text whose functions can be called on graphs.
#[derive(Debug)]
pub struct Source {
    module: Module,
    info: ModuleInfo,
    natives: Natives,
}

impl Source {
    /// Read a whole module.
    ///
    /// # Errors
    /// When it is not valid.
    pub fn new(wgsl: &str, natives: Natives) -> Result<Self, LowerError> {
        let module = naga::front::wgsl::parse_str(wgsl)
            .map_err(|error| LowerError::Unreadable(error.emit_to_string(wgsl)))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .map_err(|error| LowerError::Unreadable(error.emit_to_string(wgsl)))?;
        Ok(Self { module, info, natives })
    }

    /// The value of a function, in `graph`.
    ///
    /// # Errors
    /// When there is no such function, or it does what graphs of numbers do not have.
    pub fn call(
        &self,
        graph: &mut Graph,
        function: &str,
        arguments: Vec<Value>,
    ) -> Result<Vec<Id>, LowerError> {
        let found = self.module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(function));
        let (handle, _) = found.ok_or_else(|| LowerError::Missing(function.to_owned()))?;
        self.invoke(graph, handle, arguments)
    }

    /// The members of the structure that a function of one argument takes, and how many numbers each holds.
    ///
    /// # Errors
    /// When there is no such function, or its argument is no structure of numbers.
    pub fn argument(&self, function: &str) -> Result<Vec<(String, usize)>, LowerError> {
        let found = self.module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(function));
        let (_, found) = found.ok_or_else(|| LowerError::Missing(function.to_owned()))?;
        let inner = found.arguments.first().map(|argument| &self.module.types[argument.ty].inner);
        let members = match inner {
            Some(TypeInner::Struct { members, .. }) => &members[..],
            _ => &[],
        };
        let member = |member: &naga::StructMember| {
            let width = self.width(&self.module.types[member.ty].inner)?;
            Some((member.name.clone().unwrap_or_default(), width))
        };
        members.iter().map(member).collect::<Option<_>>().ok_or_else(|| LowerError::Unsupported {
            function: function.to_owned(),
            what: "an array".to_owned(),
        })
    }

    fn invoke(
        &self,
        graph: &mut Graph,
        handle: Handle<Function>,
        arguments: Vec<Value>,
    ) -> Result<Vec<Id>, LowerError> {
        let function = &self.module.functions[handle];
        let mut frame = Frame {
            source: self,
            graph,
            handle,
            function,
            arguments,
            values: vec![None; function.expressions.len()],
            locals: Vec::new(),
            done: None,
            returned: Vec::new(),
            finished: false,
        };
        frame.locals()?;
        frame.block(&function.body, None)?;
        let mut returned = std::mem::take(&mut frame.returned);
        let (_, mut result) = returned.pop().ok_or_else(|| frame.unsupported("no value"))?;
        for (condition, value) in returned.into_iter().rev() {
            let Some(condition) = condition else { continue };
            result = result.iter().zip(value).map(|(&no, yes)| graph.select(condition, yes, no)).collect();
        }
        Ok(result)
    }

    /// How many numbers a type holds.
    fn width(&self, inner: &TypeInner) -> Option<usize> {
        Some(match inner {
            TypeInner::Scalar(_) => 1,
            TypeInner::Vector { size, .. } => *size as usize,
            TypeInner::Struct { members, .. } => {
                members.iter().map(|m| self.width(&self.module.types[m.ty].inner)).sum::<Option<usize>>()?
            }
            _ => return None,
        })
    }
}
