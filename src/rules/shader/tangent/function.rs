//! One function's tangent: the same statements, each value beside how it moves.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use naga::{Block, Expression, Function, Handle, LocalVariable, Statement, TypeInner};

use super::types::{is_float, type_name};
use super::{TangentError, Tangents, name};

/// What is known while a function is written.
pub(super) struct Writer<'a> {
    pub(super) tangents: &'a mut Tangents,
    pub(super) function: Function,
    pub(super) handle: Handle<Function>,
    pub(super) moving: &'a [bool],
    /// Expressions that stand in a `let`.
    pub(super) named: BTreeMap<Handle<Expression>, String>,
    /// Tangents of expressions that move.
    pub(super) moved: BTreeMap<Handle<Expression>, String>,
    /// Whether anything that was returned moves.
    returns_moved: bool,
    text: String,
}

/// The tangent function's text; `None` where its value never moves.
pub(super) fn write(
    tangents: &mut Tangents,
    handle: Handle<Function>,
    moving: &[bool],
) -> Result<Option<String>, TangentError> {
    let function = tangents.module.functions[handle].clone();
    let (named, moved) = (BTreeMap::new(), BTreeMap::new());
    let mut writer = Writer {
        tangents,
        function,
        handle,
        moving,
        named,
        moved,
        returns_moved: false,
        text: String::new(),
    };
    let Some(result) = &writer.function.result else { return Ok(None) };
    let returned = writer.type_text(&writer.tangents.module.types[result.ty].inner)?;
    let head = writer.head(&returned)?;
    writer.locals()?;
    let body = writer.function.body.clone();
    writer.block(&body, &returned)?;
    Ok(writer.returns_moved.then(|| format!("\n{head}{}}}\n", writer.text)))
}

impl Writer<'_> {
    pub(super) fn unsupported(&self, what: impl Into<String>) -> TangentError {
        let function = self.function.name.clone().unwrap_or_default();
        TangentError::Unsupported { function, what: what.into() }
    }

    fn type_text(&self, inner: &TypeInner) -> Result<String, TangentError> {
        type_name(inner).ok_or_else(|| self.unsupported(format!("{inner:?}")))
    }

    /// The signature: arguments, then the tangents of those that move.
    fn head(&self, returned: &str) -> Result<String, TangentError> {
        let mut parameters = Vec::new();
        for (i, argument) in self.function.arguments.iter().enumerate() {
            let inner = &self.tangents.module.types[argument.ty].inner;
            let kind = match inner {
                TypeInner::Image { .. } => image_type(inner)
                    .ok_or_else(|| self.unsupported("a texture that is not of floats"))?
                    .to_owned(),
                other => self.type_text(other)?,
            };
            parameters.push(format!("a{i}: {kind}"));
        }
        for (i, argument) in self.function.arguments.iter().enumerate().filter(|&(i, _)| self.moving[i]) {
            let kind = self.type_text(&self.tangents.module.types[argument.ty].inner)?;
            parameters.push(format!("da{i}: {kind}"));
        }
        let name = name(self.function.name.as_deref().unwrap_or_default(), self.moving);
        Ok(format!("fn {name}({}) -> {returned} {{\n", parameters.join(", ")))
    }

    /// Variables, each beside its tangent.
    fn locals(&mut self) -> Result<(), TangentError> {
        for (handle, variable) in self.function.local_variables.clone().iter() {
            let inner = self.tangents.module.types[variable.ty].inner.clone();
            let kind = self.type_text(&inner)?;
            let name = local(handle);
            let start = match variable.init {
                Some(value) => format!(" = {}", self.value(value)?),
                None => String::new(),
            };
            let _ = writeln!(self.text, "    var {name}: {kind}{start};");
            if is_float(&inner) {
                let _ = writeln!(self.text, "    var d{name}: {kind};");
            }
        }
        Ok(())
    }

    fn block(&mut self, block: &Block, returned: &str) -> Result<(), TangentError> {
        for statement in block {
            match statement {
                Statement::Emit(range) => {
                    for expression in range.clone() {
                        self.emit(expression)?;
                    }
                }
                Statement::Block(inner) => self.block(inner, returned)?,
                Statement::If { condition, accept, reject } => {
                    let condition = self.value(*condition)?;
                    let _ = writeln!(self.text, "    if ({condition}) {{");
                    self.block(accept, returned)?;
                    if !reject.is_empty() {
                        self.text.push_str("    } else {\n");
                        self.block(reject, returned)?;
                    }
                    self.text.push_str("    }\n");
                }
                Statement::Return { value: Some(value) } => {
                    let moved = self.tangent(*value);
                    self.returns_moved |= moved.is_some();
                    let moved = moved.unwrap_or_else(|| format!("{returned}()"));
                    let _ = writeln!(self.text, "    return {moved};");
                }
                Statement::Store { pointer, value } => self.store(*pointer, *value)?,
                Statement::Call { function, arguments, result: Some(result) } => {
                    self.call(*function, arguments, *result)?;
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

    /// A `let` for the expression, and one for its tangent where it moves.
    fn emit(&mut self, handle: Handle<Expression>) -> Result<(), TangentError> {
        if self.is_pointer(handle) {
            return Ok(());
        }
        let value = self.text_of(handle)?;
        let name = format!("e{}", handle.index());
        let _ = writeln!(self.text, "    let {name} = {value};");
        self.named.insert(handle, name);
        if let Some(tangent) = self.tangent_of(handle)? {
            let name = format!("d{}", handle.index());
            let _ = writeln!(self.text, "    let {name} = {tangent};");
            self.moved.insert(handle, name);
        }
        Ok(())
    }

    fn store(&mut self, pointer: Handle<Expression>, value: Handle<Expression>) -> Result<(), TangentError> {
        let place = self.place(pointer)?;
        let moves = is_float(&self.inner(value));
        let (tangent, kind) = (self.tangent(value), self.type_text(&self.inner(value))?);
        let text = self.value(value)?;
        let _ = writeln!(self.text, "    {place} = {text};");
        if moves {
            let _ = writeln!(self.text, "    d{place} = {};", tangent.unwrap_or_else(|| format!("{kind}()")));
        }
        Ok(())
    }

    fn call(
        &mut self,
        callee: Handle<Function>,
        arguments: &[Handle<Expression>],
        result: Handle<Expression>,
    ) -> Result<(), TangentError> {
        let function = self.tangents.module.functions[callee].clone();
        let called = function.name.clone().unwrap_or_default();
        let values = arguments.iter().map(|&a| self.value(a)).collect::<Result<Vec<_>, _>>()?;
        let name = format!("e{}", result.index());
        let _ = writeln!(self.text, "    let {name} = {called}({});", values.join(", "));
        self.named.insert(result, name);
        let moving: Vec<bool> = arguments.iter().map(|&a| self.tangent(a).is_some()).collect();
        if !moving.contains(&true) || !is_float(&self.inner(result)) {
            return Ok(());
        }
        if self.tangents.has_partials(&function) {
            return self.by_partials(&called, (arguments, &values), result);
        }
        let Some(tangent) = self.tangents.of(&called, &moving)? else { return Ok(()) };
        let mut given = values;
        for (argument, formal) in arguments.iter().zip(&function.arguments) {
            let inner = self.tangents.module.types[formal.ty].inner.clone();
            match self.tangent(*argument) {
                Some(moved) => given.push(moved),
                None if tangent.of_all && is_float(&inner) => {
                    given.push(format!("{}()", self.type_text(&inner)?));
                }
                None => {}
            }
        }
        let name = format!("d{}", result.index());
        let _ = writeln!(self.text, "    let {name} = {}({});", tangent.name, given.join(", "));
        self.moved.insert(result, name);
        Ok(())
    }

    /// A call's tangent by partial derivatives. Each is a tangent along 1, whose products with 1 vanish; and as it is the same
    /// whatever moves the arguments, all parameters share it.
    fn by_partials(
        &mut self,
        called: &str,
        (arguments, values): (&[Handle<Expression>], &[String]),
        result: Handle<Expression>,
    ) -> Result<(), TangentError> {
        let mut terms = Vec::new();
        for (k, &argument) in arguments.iter().enumerate() {
            let Some(moved) = self.tangent(argument) else { continue };
            let along: Vec<bool> = (0..arguments.len()).map(|other| other == k).collect();
            if let Some(partial) = self.tangents.of(called, &along)? {
                terms.push(format!("{}({}, 1.0) * {moved}", partial.name, values.join(", ")));
            }
        }
        if !terms.is_empty() {
            let name = format!("d{}", result.index());
            let _ = writeln!(self.text, "    let {name} = {};", terms.join(" + "));
            self.moved.insert(result, name);
        }
        Ok(())
    }
}

/// A variable's name.
pub(super) fn local(handle: Handle<LocalVariable>) -> String {
    format!("v{}", handle.index())
}

/// The WGSL type of a texture that functions are handed.
const fn image_type(inner: &TypeInner) -> Option<&'static str> {
    use naga::{ImageClass, ImageDimension, ScalarKind};
    match inner {
        TypeInner::Image {
            dim: ImageDimension::D2,
            arrayed,
            class: ImageClass::Sampled { kind: ScalarKind::Float, multi: false },
        } => Some(if *arrayed { "texture_2d_array<f32>" } else { "texture_2d<f32>" }),
        _ => None,
    }
}
