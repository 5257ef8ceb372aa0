//! The rules' WGSL as a graph: functions are called in place, branches become choices.
//!
//! - lookups in faces are one call (`sample_faces` of `rules/lib/cube.wgsl`, and its tangent), as their texels are
//!   addressed by whole numbers, which graphs have not; `is_finite` likewise
//! - so are unit vectors and places on cubes ([`super::native`]), which every fragment needs again and again
//! - both sides of an `if` are computed, and a value chosen where they meet: the rules' branches are short

mod math;

use naga::proc::TypeResolution;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{
    Block, Expression as E, Function, Handle, Literal, Module, ScalarKind, Statement, TypeInner,
    UnaryOperator as U,
};

use super::graph::{Graph, Id, Native, Unary};

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

/// What a literal stands for: a constant of mathematics whose nearest f32 it is; else what was written, as the shortest
/// decimal of an f32 is. 0.1 is meant, not the f32 next to it.
fn meant(x: f32) -> f64 {
    let known = [std::f64::consts::LN_2, std::f64::consts::PI, std::f64::consts::PI / 180.0];
    let exact = known.into_iter().find(|known| *known as f32 == x);
    exact.unwrap_or_else(|| format!("{x:e}").parse().unwrap_or_else(|_| f64::from(x)))
}

/// One call.
struct Frame<'a> {
    source: &'a Source,
    graph: &'a mut Graph,
    handle: Handle<Function>,
    function: &'a Function,
    arguments: Vec<Value>,
    /// Expressions that were reached.
    values: Vec<Option<Value>>,
    /// The local variables' numbers.
    locals: Vec<Vec<Id>>,
    /// Where the function has returned already.
    done: Option<Id>,
    /// What it returned, and where.
    returned: Vec<(Option<Id>, Vec<Id>)>,
    finished: bool,
}

/// Where a pointer leads.
enum Place {
    /// Numbers of a local variable: its index, the first, and how many.
    Local(usize, usize, usize),
    /// Numbers of a member of the uniform block: its name, the first, and how many.
    Uniform(String, usize, usize),
}

impl Frame<'_> {
    fn unsupported(&self, what: impl Into<String>) -> LowerError {
        let function = self.function.name.clone().unwrap_or_default();
        LowerError::Unsupported { function, what: what.into() }
    }

    fn inner(&self, handle: Handle<E>) -> &TypeInner {
        match &self.source.info[self.handle][handle].ty {
            TypeResolution::Handle(ty) => &self.source.module.types[*ty].inner,
            TypeResolution::Value(inner) => inner,
        }
    }

    fn locals(&mut self) -> Result<(), LowerError> {
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
    fn effective(&mut self, condition: Option<Id>) -> Option<Id> {
        match (condition, self.done) {
            (condition, None) => condition,
            (None, Some(done)) => Some(self.graph.not(done)),
            (Some(condition), Some(done)) => {
                let going = self.graph.not(done);
                Some(self.graph.and(condition, going))
            }
        }
    }

    fn block(&mut self, block: &Block, condition: Option<Id>) -> Result<(), LowerError> {
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

    fn called(&mut self, callee: Handle<Function>, arguments: Vec<Value>) -> Result<Vec<Id>, LowerError> {
        let called = self.source.natives == Natives::Called;
        match (self.source.module.functions[callee].name.as_deref(), &arguments[..]) {
            (Some("sample_faces"), [Value::Texture(name), _, Value::Numbers(place)]) => {
                let resource = self.graph.resource(name);
                Ok(self.graph.call(Native::Lookup(resource), place.clone(), Vec::new()))
            }
            // The tangent along the place alone; see `tangent::name`.
            (
                Some("sample_faces_ccd"),
                [Value::Texture(name), _, Value::Numbers(place), Value::Numbers(along)],
            ) => {
                let resource = self.graph.resource(name);
                Ok(self.graph.call(Native::Lookup(resource), place.clone(), along[1..].to_vec()))
            }
            (Some("cube_place_of_unit"), [Value::Numbers(direction)]) if called => {
                Ok(self.graph.call(Native::Place, direction.clone(), Vec::new()))
            }
            (Some("cube_place_of_unit_tangent"), [Value::Numbers(direction), Value::Numbers(along)])
                if called =>
            {
                let moved = self.graph.call(Native::Place, direction.clone(), along.clone());
                Ok([vec![self.graph.constant(0.0)], moved].concat())
            }
            (Some("normalize_or"), [Value::Numbers(v), Value::Numbers(fallback)]) if called => {
                Ok(self.graph.call(Native::Unit, [&v[..], fallback].concat(), Vec::new()))
            }
            (
                Some("normalize_or_tangent"),
                [Value::Numbers(v), Value::Numbers(fallback), Value::Numbers(along), Value::Numbers(other)],
            ) if called && other.iter().all(|&id| self.graph.value(id) == Some(0.0)) => {
                Ok(self.graph.call(Native::Unit, [&v[..], fallback].concat(), along.clone()))
            }
            (Some("is_finite"), _) => {
                let numbers = arguments.into_iter().next().and_then(Value::numbers).unwrap_or_default();
                let mut all = self.graph.constant(1.0);
                for number in numbers {
                    let finite = self.graph.unary(Unary::IsFinite, number);
                    all = self.graph.and(all, finite);
                }
                Ok(vec![all])
            }
            _ => self.source.invoke(self.graph, callee, arguments),
        }
    }

    fn place(&mut self, pointer: Handle<E>) -> Result<Place, LowerError> {
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
    fn member(&self, global: Handle<naga::GlobalVariable>, index: usize) -> Result<Place, LowerError> {
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
    fn pointee(&self, pointer: Handle<E>) -> TypeInner {
        match *self.inner(pointer) {
            TypeInner::Pointer { base, .. } => self.source.module.types[base].inner.clone(),
            TypeInner::ValuePointer { size: Some(size), scalar, .. } => TypeInner::Vector { size, scalar },
            TypeInner::ValuePointer { size: None, scalar, .. } => TypeInner::Scalar(scalar),
            ref other => other.clone(),
        }
    }

    /// Where a component or member stands, and how many numbers it is.
    fn within(&self, inner: &TypeInner, index: usize) -> Option<(usize, usize)> {
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

    fn value(&mut self, handle: Handle<E>) -> Result<Value, LowerError> {
        match &self.values[handle.index()] {
            Some(value) => Ok(value.clone()),
            None => self.expression(handle),
        }
    }

    fn numbers(&mut self, handle: Handle<E>) -> Result<Vec<Id>, LowerError> {
        self.value(handle)?.numbers().ok_or_else(|| self.unsupported("a texture in the place of a number"))
    }

    fn number(&mut self, handle: Handle<E>) -> Result<Id, LowerError> {
        let numbers = self.numbers(handle)?;
        numbers.first().copied().ok_or_else(|| self.unsupported("nothing in the place of a number"))
    }

    fn expression(&mut self, handle: Handle<E>) -> Result<Value, LowerError> {
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

    fn literal(&mut self, literal: Literal) -> Result<Id, LowerError> {
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
    fn global(&mut self, handle: Handle<E>) -> Result<Vec<Id>, LowerError> {
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
    fn by_components(
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
