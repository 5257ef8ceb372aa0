//! Expressions as numbers, component by component.

use naga::{Expression as E, Handle, Literal, ScalarKind, UnaryOperator as U};

use super::frame::{Frame, Place};
use super::{LowerError, STEP_ALONG_U, STEP_ALONG_V, Value};
use crate::program::graph::{Graph, Id, Unary};

/// What a literal stands for: a constant of mathematics whose nearest f32 it is; else what was written, as the shortest
/// decimal of an f32 is. 0.1 is meant, not the f32 next to it.
fn meant(x: f32) -> f64 {
    use std::f64::consts::{FRAC_1_PI, LN_2, PI};
    let known = [LN_2, PI, FRAC_1_PI, PI / 180.0];
    let exact = known.into_iter().find(|known| *known as f32 == x);
    exact.unwrap_or_else(|| format!("{x:e}").parse().unwrap_or_else(|_| f64::from(x)))
}

impl Frame<'_> {
    pub(super) fn expression(&mut self, handle: Handle<E>) -> Result<Value, LowerError> {
        let numbers = match &self.function.expressions[handle] {
            E::Literal(literal) => vec![self.literal(*literal)?],
            E::Constant(constant) => {
                let init = self.source.module.constants[*constant].init;
                self.global(init)?
            }
            E::ZeroValue(ty) => {
                let width = self.source.width(&self.source.module.types[*ty].inner);
                let width = width.ok_or_else(|| self.unsupported("an array"))?;
                vec![self.graph.constant(0.0); width]
            }
            E::FunctionArgument(i) => {
                let argument = self.arguments.get(*i as usize).cloned();
                return argument.ok_or_else(|| self.unsupported("an argument that was not given"));
            }
            E::GlobalVariable(global) => {
                let name = self.source.module.global_variables[*global].name.clone();
                return Ok(Value::Texture(name.unwrap_or_default()));
            }
            E::Compose { components, .. } => {
                let mut all = Vec::new();
                for &component in components {
                    all.extend(self.numbers(component)?);
                }
                all
            }
            E::Splat { size, value } => vec![self.number(*value)?; *size as usize],
            E::AccessIndex { base, index } => {
                let inner = self.inner(*base).clone();
                let (first, width) = self
                    .within(&inner, *index as usize)
                    .ok_or_else(|| self.unsupported("an array's element"))?;
                self.numbers(*base)?[first..first + width].to_vec()
            }
            E::Access { base, index } => {
                let (base, index) = (self.numbers(*base)?, self.number(*index)?);
                let at = self.graph.value(index).ok_or_else(|| self.unsupported("a computed index"))?;
                let found = base.get(at as usize).copied();
                vec![found.ok_or_else(|| self.unsupported("an index that is too large"))?]
            }
            E::Swizzle { size, vector, pattern } => {
                let vector = self.numbers(*vector)?;
                pattern[..*size as usize].iter().map(|&c| vector[c as usize]).collect()
            }
            E::Load { pointer } => match self.place(*pointer)? {
                Place::Local(variable, first, width) => self.locals[variable][first..first + width].to_vec(),
                Place::Uniform(name, first, width) => {
                    (first..first + width).map(|component| self.graph.uniform(&name, component)).collect()
                }
            },
            E::Unary { op, expr } => {
                let numbers = self.numbers(*expr)?;
                let op = *op;
                match op {
                    U::Negate => numbers.into_iter().map(|x| self.graph.unary(Unary::Negate, x)).collect(),
                    U::LogicalNot => numbers.into_iter().map(|x| self.graph.not(x)).collect(),
                    U::BitwiseNot => return Err(self.unsupported("operator ~")),
                }
            }
            E::Binary { op, left, right } => {
                let (op, left, right) = (*op, self.numbers(*left)?, self.numbers(*right)?);
                self.by_components(&[left, right], |frame, x| frame.binary(op, x[0], x[1]))?
            }
            E::Select { condition, accept, reject } => {
                let (condition, yes, no) =
                    (self.numbers(*condition)?, self.numbers(*accept)?, self.numbers(*reject)?);
                self.by_components(&[condition, yes, no], |frame, x| {
                    Ok(frame.graph.select(x[0], x[1], x[2]))
                })?
            }
            // A number is a number here.
            E::As { expr, kind: ScalarKind::Float, convert: Some(_) } => self.numbers(*expr)?,
            E::Relational { fun, argument } => {
                let all = self.numbers(*argument)?;
                let both = match fun {
                    naga::RelationalFunction::All => Graph::and,
                    naga::RelationalFunction::Any => Graph::or,
                    _ => return Err(self.unsupported("isnan or isinf (write is_finite)")),
                };
                all.into_iter().reduce(|a, b| both(self.graph, a, b)).into_iter().collect()
            }
            E::Derivative { axis, expr, .. } => {
                let numbers = self.numbers(*expr)?;
                let prefix = match axis {
                    naga::DerivativeAxis::X => STEP_ALONG_U,
                    naga::DerivativeAxis::Y => STEP_ALONG_V,
                    naga::DerivativeAxis::Width => return Err(self.unsupported("fwidth")),
                };
                let step = |id: Id| self.graph.step(id, prefix);
                let steps: Option<Vec<Id>> = numbers.into_iter().map(step).collect();
                steps.ok_or_else(|| self.unsupported("dpdx or dpdy of what no vertex holds"))?
            }
            E::Math { fun, arg, arg1, arg2, .. } => {
                let arguments: Vec<Vec<Id>> = [Some(*arg), *arg1, *arg2]
                    .into_iter()
                    .flatten()
                    .map(|a| self.numbers(a))
                    .collect::<Result<_, _>>()?;
                self.math(*fun, &arguments)?
            }
            other => {
                let words = format!("{other:?}");
                let what = words.split([' ', '(', '{']).next().unwrap_or_default().to_owned();
                return Err(self.unsupported(format!("expression {what}")));
            }
        };
        Ok(Value::Numbers(numbers))
    }

    pub(super) fn literal(&mut self, literal: Literal) -> Result<Id, LowerError> {
        let value = match literal {
            // The shortest decimal of an f32 is what was written: 0.1 is meant, not the f32 next to it.
            Literal::F32(x) => meant(x),
            Literal::AbstractFloat(x) | Literal::F64(x) => x,
            Literal::I32(x) => x.into(),
            Literal::U32(x) => x.into(),
            Literal::Bool(x) => f64::from(u8::from(x)),
            other => return Err(self.unsupported(format!("{other:?}"))),
        };
        Ok(self.graph.constant(value))
    }

    /// A module's constant.
    pub(super) fn global(&mut self, handle: Handle<E>) -> Result<Vec<Id>, LowerError> {
        match &self.source.module.global_expressions[handle] {
            E::Literal(literal) => Ok(vec![self.literal(*literal)?]),
            E::Constant(constant) => self.global(self.source.module.constants[*constant].init),
            E::Compose { components, .. } => {
                let parts = components.iter().map(|&c| self.global(c)).collect::<Result<Vec<_>, _>>()?;
                Ok(parts.concat())
            }
            E::Splat { size, value } => Ok(vec![self.global(*value)?[0]; *size as usize]),
            _ => Err(self.unsupported("a computed constant")),
        }
    }

    /// Component by component; a single number stands for as many as the others have.
    pub(super) fn by_components(
        &mut self,
        arguments: &[Vec<Id>],
        mut of: impl FnMut(&mut Self, &[Id]) -> Result<Id, LowerError>,
    ) -> Result<Vec<Id>, LowerError> {
        let width = arguments.iter().map(Vec::len).max().unwrap_or(0);
        (0..width)
            .map(|k| {
                let at: Vec<Id> = arguments.iter().map(|a| a[k % a.len()]).collect();
                of(self, &at)
            })
            .collect()
    }
}
