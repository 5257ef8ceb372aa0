//! One call of a function: its statements in their order, each under the condition on which it is reached.

use naga::proc::TypeResolution;
use naga::{Block, Expression as E, Function, Handle, Statement, TypeInner};

use super::{LowerError, Source, Value};
use crate::program::graph::{Graph, Id};

/// One call.
pub(super) struct Frame<'a> {
    pub(super) source: &'a Source,
    pub(super) graph: &'a mut Graph,
    pub(super) handle: Handle<Function>,
    pub(super) function: &'a Function,
    pub(super) arguments: Vec<Value>,
    /// Expressions that were reached.
    pub(super) values: Vec<Option<Value>>,
    /// The local variables' numbers.
    pub(super) locals: Vec<Vec<Id>>,
    /// Where the function has returned already.
    pub(super) done: Option<Id>,
    /// What it returned, and where.
    pub(super) returned: Vec<(Option<Id>, Vec<Id>)>,
    pub(super) finished: bool,
}

/// Where a pointer leads.
pub(super) enum Place {
    /// Numbers of a local variable: its index, the first, and how many.
    Local(usize, usize, usize),
    /// Numbers of a member of the uniform block: its name, the first, and how many.
    Uniform(String, usize, usize),
}

impl Frame<'_> {
    pub(super) fn unsupported(&self, what: impl Into<String>) -> LowerError {
        let function = self.function.name.clone().unwrap_or_default();
        LowerError::Unsupported { function, what: what.into() }
    }

    pub(super) fn inner(&self, handle: Handle<E>) -> &TypeInner {
        match &self.source.info[self.handle][handle].ty {
            TypeResolution::Handle(ty) => &self.source.module.types[*ty].inner,
            TypeResolution::Value(inner) => inner,
        }
    }

    pub(super) fn locals(&mut self) -> Result<(), LowerError> {
        for (_, variable) in self.function.local_variables.iter() {
            let inner = &self.source.module.types[variable.ty].inner;
            let width = self.source.width(inner).ok_or_else(|| self.unsupported("an array"))?;
            let start = match variable.init {
                Some(value) => self.numbers(value)?,
                None => vec![self.graph.constant(0.0); width],
            };
            self.locals.push(start);
        }
        Ok(())
    }

    /// Where a statement under `condition` takes effect; `None` everywhere.
    pub(super) fn effective(&mut self, condition: Option<Id>) -> Option<Id> {
        match (condition, self.done) {
            (condition, None) => condition,
            (None, Some(done)) => Some(self.graph.not(done)),
            (Some(condition), Some(done)) => {
                let going = self.graph.not(done);
                Some(self.graph.and(condition, going))
            }
        }
    }

    pub(super) fn block(&mut self, block: &Block, condition: Option<Id>) -> Result<(), LowerError> {
        for statement in block {
            if self.finished {
                return Ok(());
            }
            match statement {
                Statement::Emit(range) => {
                    for expression in range.clone() {
                        if !matches!(
                            self.inner(expression),
                            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. }
                        ) {
                            let value = self.expression(expression)?;
                            self.values[expression.index()] = Some(value);
                        }
                    }
                }
                Statement::Block(inner) => self.block(inner, condition)?,
                Statement::If { condition: test, accept, reject } => {
                    let test = self.number(*test)?;
                    let opposite = self.graph.not(test);
                    for (test, block) in [(test, accept), (opposite, reject)] {
                        match self.graph.value(test) {
                            Some(0.0) => {}
                            Some(_) => self.block(block, condition)?,
                            None => {
                                let both = condition.map_or(test, |outer| self.graph.and(outer, test));
                                self.block(block, Some(both))?;
                            }
                        }
                    }
                }
                Statement::Return { value: Some(value) } => {
                    let value = self.numbers(*value)?;
                    let effective = self.effective(condition);
                    self.returned.push((effective, value));
                    match condition {
                        None => self.finished = true,
                        Some(here) => {
                            self.done = Some(self.done.map_or(here, |done| self.graph.or(done, here)));
                        }
                    }
                }
                Statement::Store { pointer, value } => {
                    let Place::Local(variable, first, width) = self.place(*pointer)? else {
                        return Err(self.unsupported("a store outside local variables"));
                    };
                    let value = self.numbers(*value)?;
                    let effective = self.effective(condition);
                    for (k, new) in value.into_iter().enumerate().take(width) {
                        let old = self.locals[variable][first + k];
                        let chosen = effective.map_or(new, |here| self.graph.select(here, new, old));
                        self.locals[variable][first + k] = chosen;
                    }
                }
                Statement::Call { function, arguments, result: Some(result) } => {
                    let arguments =
                        arguments.iter().map(|&a| self.value(a)).collect::<Result<Vec<_>, _>>()?;
                    let value = self.called(*function, arguments)?;
                    self.values[result.index()] = Some(Value::Numbers(value));
                }
                other => {
                    let words = format!("{other:?}");
                    let what = words.split([' ', '(', '{']).next().unwrap_or_default().to_owned();
                    return Err(self.unsupported(format!("statement {what}")));
                }
            }
        }
        Ok(())
    }

    pub(super) fn value(&mut self, handle: Handle<E>) -> Result<Value, LowerError> {
        match &self.values[handle.index()] {
            Some(value) => Ok(value.clone()),
            None => self.expression(handle),
        }
    }

    pub(super) fn numbers(&mut self, handle: Handle<E>) -> Result<Vec<Id>, LowerError> {
        self.value(handle)?.numbers().ok_or_else(|| self.unsupported("a texture in the place of a number"))
    }

    pub(super) fn number(&mut self, handle: Handle<E>) -> Result<Id, LowerError> {
        let numbers = self.numbers(handle)?;
        numbers.first().copied().ok_or_else(|| self.unsupported("nothing in the place of a number"))
    }
}
