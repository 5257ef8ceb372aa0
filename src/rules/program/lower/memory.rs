//! Where pointers lead: local variables, and the uniform block.

use naga::{Expression as E, Handle, TypeInner};

use super::LowerError;
use super::frame::{Frame, Place};

impl Frame<'_> {
    pub(super) fn place(&mut self, pointer: Handle<E>) -> Result<Place, LowerError> {
        match &self.function.expressions[pointer] {
            E::LocalVariable(variable) => {
                let index = variable.index();
                Ok(Place::Local(index, 0, self.locals[index].len()))
            }
            E::AccessIndex { base, index } => {
                if let E::GlobalVariable(global) = self.function.expressions[*base] {
                    return self.member(global, *index as usize);
                }
                let (inner, index) = (self.pointee(*base), *index as usize);
                let (first, width) =
                    self.within(&inner, index).ok_or_else(|| self.unsupported("an array's element"))?;
                Ok(match self.place(*base)? {
                    Place::Local(variable, at, _) => Place::Local(variable, at + first, width),
                    Place::Uniform(name, at, _) => Place::Uniform(name, at + first, width),
                })
            }
            _ => Err(self.unsupported("memory that is neither a variable nor a constant")),
        }
    }

    /// A member of the uniform block.
    pub(super) fn member(
        &self,
        global: Handle<naga::GlobalVariable>,
        index: usize,
    ) -> Result<Place, LowerError> {
        let module = &self.source.module;
        let inner = &module.types[module.global_variables[global].ty].inner;
        let TypeInner::Struct { members, .. } = inner else {
            return Err(self.unsupported("memory that is no block of constants"));
        };
        let member = &members[index];
        let width = self.source.width(&module.types[member.ty].inner);
        let width = width.ok_or_else(|| self.unsupported("a constant that is no vector"))?;
        Ok(Place::Uniform(member.name.clone().unwrap_or_default(), 0, width))
    }

    /// The type that a pointer leads to.
    pub(super) fn pointee(&self, pointer: Handle<E>) -> TypeInner {
        match *self.inner(pointer) {
            TypeInner::Pointer { base, .. } => self.source.module.types[base].inner.clone(),
            TypeInner::ValuePointer { size: Some(size), scalar, .. } => TypeInner::Vector { size, scalar },
            TypeInner::ValuePointer { size: None, scalar, .. } => TypeInner::Scalar(scalar),
            ref other => other.clone(),
        }
    }

    /// Where a component or member stands, and how many numbers it is.
    pub(super) fn within(&self, inner: &TypeInner, index: usize) -> Option<(usize, usize)> {
        match inner {
            TypeInner::Vector { .. } => Some((index, 1)),
            TypeInner::Struct { members, .. } => {
                let width = |m: &naga::StructMember| self.source.width(&self.source.module.types[m.ty].inner);
                let before = members[..index].iter().map(width).sum::<Option<usize>>()?;
                Some((before, width(&members[index])?))
            }
            _ => None,
        }
    }
}
