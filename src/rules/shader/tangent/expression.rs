//! Expressions as WGSL, and the chain rule for each.

use naga::proc::TypeResolution;
use naga::{
    BinaryOperator as B, DerivativeAxis, DerivativeControl, Expression as E, Handle, ImageQuery, Literal,
    MathFunction as M, TypeInner, UnaryOperator as U, VectorSize,
};

use super::TangentError;
use super::function::{Writer, local};
use super::types::{is_float, type_name};

const COMPONENTS: [&str; 4] = ["x", "y", "z", "w"];

impl Writer<'_> {
    pub(super) fn inner(&self, handle: Handle<E>) -> TypeInner {
        let module = &self.tangents.module;
        match &self.tangents.info[self.handle][handle].ty {
            TypeResolution::Handle(ty) => module.types[*ty].inner.clone(),
            TypeResolution::Value(inner) => inner.clone(),
        }
    }

    pub(super) fn is_pointer(&self, handle: Handle<E>) -> bool {
        matches!(self.inner(handle), TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. })
    }

    /// The variable, or its component, that a pointer leads to.
    pub(super) fn place(&self, pointer: Handle<E>) -> Result<String, TangentError> {
        match &self.function.expressions[pointer] {
            E::LocalVariable(variable) => Ok(local(*variable)),
            E::AccessIndex { base, index } => {
                Ok(format!("{}.{}", self.place(*base)?, COMPONENTS[*index as usize % 4]))
            }
            _ => Err(self.unsupported("memory other than local variables")),
        }
    }

    /// A name, or the text of what needs none.
    pub(super) fn value(&self, handle: Handle<E>) -> Result<String, TangentError> {
        self.named.get(&handle).map_or_else(|| self.text_of(handle), |name| Ok(name.clone()))
    }

    fn values(&self, handles: &[Handle<E>]) -> Result<String, TangentError> {
        Ok(handles.iter().map(|&h| self.value(h)).collect::<Result<Vec<_>, _>>()?.join(", "))
    }

    /// An expression in terms of its parts' names.
    pub(super) fn text_of(&self, handle: Handle<E>) -> Result<String, TangentError> {
        let kind = || type_name(&self.inner(handle)).ok_or_else(|| self.unsupported("a type of its own"));
        Ok(match &self.function.expressions[handle] {
            E::Literal(literal) => self.literal(*literal)?,
            E::ZeroValue(_) => format!("{}()", kind()?),
            E::FunctionArgument(i) => format!("a{i}"),
            E::GlobalVariable(variable) => {
                self.tangents.module.global_variables[*variable].name.clone().unwrap_or_default()
            }
            E::Compose { components, .. } => format!("{}({})", kind()?, self.values(components)?),
            E::Splat { value, .. } => format!("{}({})", kind()?, self.value(*value)?),
            E::Access { base, index } => format!("{}[{}]", self.value(*base)?, self.value(*index)?),
            E::AccessIndex { base, index } => {
                format!("{}.{}", self.value(*base)?, COMPONENTS[*index as usize % 4])
            }
            E::Swizzle { size, vector, pattern } => {
                format!("{}.{}", self.value(*vector)?, swizzle(*size, pattern))
            }
            E::Load { pointer } => self.place(*pointer)?,
            E::Unary { op, expr } => {
                let sign = match op {
                    U::Negate => "-",
                    U::LogicalNot => "!",
                    U::BitwiseNot => "~",
                };
                format!("{sign}({})", self.value(*expr)?)
            }
            E::Binary { op, left, right } => {
                format!("{} {} {}", self.value(*left)?, operator(*op), self.value(*right)?)
            }
            E::Select { condition, accept, reject } => {
                format!("select({})", self.values(&[*reject, *accept, *condition])?)
            }
            E::Math { fun, arg, arg1, arg2, arg3 } => {
                let name = function_name(*fun).ok_or_else(|| self.unsupported(format!("{fun:?}")))?;
                let arguments: Vec<_> = [Some(*arg), *arg1, *arg2, *arg3].into_iter().flatten().collect();
                format!("{name}({})", self.values(&arguments)?)
            }
            E::As { expr, convert, .. } => {
                let kind = kind()?;
                let value = self.value(*expr)?;
                if convert.is_some() {
                    format!("{kind}({value})")
                } else {
                    format!("bitcast<{kind}>({value})")
                }
            }
            E::ImageLoad { image, coordinate, array_index, level: Some(level), sample: None } => {
                let arguments: Vec<_> = [Some(*image), Some(*coordinate), *array_index, Some(*level)]
                    .into_iter()
                    .flatten()
                    .collect();
                format!("textureLoad({})", self.values(&arguments)?)
            }
            E::Derivative { axis, ctrl, expr } => {
                format!("{}({})", slope_name(*axis, *ctrl), self.value(*expr)?)
            }
            E::ImageQuery { image, query: ImageQuery::Size { level: None } } => {
                format!("textureDimensions({})", self.value(*image)?)
            }
            other => {
                let words = format!("{other:?}");
                let what = words.split([' ', '(', '{']).next().unwrap_or_default();
                return Err(self.unsupported(format!("expression {what}")));
            }
        })
    }

    fn literal(&self, literal: Literal) -> Result<String, TangentError> {
        Ok(match literal {
            Literal::F32(x) => format!("{x:?}f"),
            Literal::I32(x) => format!("i32({x})"),
            Literal::U32(x) => format!("{x}u"),
            Literal::Bool(x) => x.to_string(),
            other => return Err(self.unsupported(format!("{other:?}"))),
        })
    }

    /// How an expression moves; `None` where it stays.
    pub(super) fn tangent_of(&self, handle: Handle<E>) -> Result<Option<String>, TangentError> {
        let inner = self.inner(handle);
        if !is_float(&inner) {
            return Ok(None);
        }
        let kind = type_name(&inner).ok_or_else(|| self.unsupported("a matrix"))?;
        let moved = |h: Handle<E>| self.tangent(h);
        let or_zero = |h: Handle<E>| -> Result<String, TangentError> {
            let zero = || type_name(&self.inner(h)).map(|kind| format!("{kind}()"));
            moved(h).or_else(zero).ok_or_else(|| self.unsupported("a matrix"))
        };
        Ok(match &self.function.expressions[handle] {
            E::Compose { components, .. } if components.iter().any(|&c| moved(c).is_some()) => {
                let parts = components.iter().map(|&c| or_zero(c)).collect::<Result<Vec<_>, _>>()?;
                Some(format!("{kind}({})", parts.join(", ")))
            }
            E::Splat { value, .. } => moved(*value).map(|d| format!("{kind}({d})")),
            E::Access { base, index } => match moved(*base) {
                Some(d) => Some(format!("{d}[{}]", self.value(*index)?)),
                None => None,
            },
            E::AccessIndex { base, index } => {
                moved(*base).map(|d| format!("{d}.{}", COMPONENTS[*index as usize % 4]))
            }
            E::Swizzle { size, vector, pattern } => {
                moved(*vector).map(|d| format!("{d}.{}", swizzle(*size, pattern)))
            }
            E::Load { pointer } => Some(format!("d{}", self.place(*pointer)?)),
            E::Unary { op: U::Negate, expr } => moved(*expr).map(|d| format!("-({d})")),
            E::Binary { op, left, right } => self.binary(handle, *op, *left, *right)?,
            E::Select { condition, accept, reject }
                if moved(*accept).is_some() || moved(*reject).is_some() =>
            {
                let (no, yes) = (or_zero(*reject)?, or_zero(*accept)?);
                Some(format!("select({no}, {yes}, {})", self.value(*condition)?))
            }
            E::Math { fun, arg, arg1, arg2, .. } => {
                let arguments: Vec<_> = [Some(*arg), *arg1, *arg2].into_iter().flatten().collect();
                if arguments.iter().any(|&a| moved(a).is_some()) {
                    let tangents = arguments.iter().map(|&a| or_zero(a)).collect::<Result<Vec<_>, _>>()?;
                    self.math(handle, *fun, &arguments, &tangents)?
                } else {
                    None
                }
            }
            E::As { expr, .. } if moved(*expr).is_some() => {
                return Err(self.unsupported("a conversion of what moves"));
            }
            // Between neighbours values and tangents are told apart alike; their size is no linear function.
            E::Derivative { axis: DerivativeAxis::Width, expr, .. } if moved(*expr).is_some() => {
                return Err(self.unsupported("fwidth of what moves"));
            }
            E::Derivative { axis, ctrl, expr } => {
                moved(*expr).map(|d| format!("{}({d})", slope_name(*axis, *ctrl)))
            }
            E::ImageSample { .. } => return Err(self.unsupported("the hardware's filtering")),
            _ => None,
        })
    }

    /// The tangent of a part.
    pub(super) fn tangent(&self, handle: Handle<E>) -> Option<String> {
        match &self.function.expressions[handle] {
            E::FunctionArgument(i) => self.moving[*i as usize].then(|| format!("da{i}")),
            _ => self.moved.get(&handle).cloned(),
        }
    }

    fn binary(
        &self,
        result: Handle<E>,
        op: B,
        left: Handle<E>,
        right: Handle<E>,
    ) -> Result<Option<String>, TangentError> {
        let (a, b) = (self.value(left)?, self.value(right)?);
        let kind = type_name(&self.inner(result)).unwrap_or_default();
        // A scalar's tangent beside a vector has to be widened.
        let wide = |d: String| format!("{kind}({d})");
        Ok(match (op, self.tangent(left), self.tangent(right)) {
            (_, None, None) => None,
            (B::Add, Some(da), Some(db)) => Some(format!("{da} + {db}")),
            (B::Add, Some(d), None) | (B::Add | B::Subtract, None, Some(d)) if op == B::Add => Some(wide(d)),
            (B::Subtract, Some(da), Some(db)) => Some(format!("{da} - {db}")),
            (B::Subtract, Some(d), None) => Some(wide(d)),
            (B::Subtract, None, Some(d)) => Some(wide(format!("-({d})"))),
            (B::Multiply, Some(da), Some(db)) => Some(format!("{da} * {b} + {a} * {db}")),
            (B::Multiply, Some(da), None) => Some(format!("{da} * {b}")),
            (B::Multiply, None, Some(db)) => Some(format!("{a} * {db}")),
            (B::Divide, Some(da), None) => Some(format!("{da} / {b}")),
            (B::Divide, da, Some(db)) => {
                let quotient = self.value(result).unwrap_or_else(|_| format!("({a} / {b})"));
                let change =
                    da.map_or_else(|| format!("-{quotient} * {db}"), |d| format!("{d} - {quotient} * {db}"));
                Some(format!("({change}) / {b}"))
            }
            _ => return Err(self.unsupported(format!("{op:?}"))),
        })
    }

    /// A built-in function's tangent. At a kink the second argument counts as the constant one, and moves
    /// nothing: the subgradients of MODEL 7.
    fn math(
        &self,
        result: Handle<E>,
        fun: M,
        arguments: &[Handle<E>],
        d: &[String],
    ) -> Result<Option<String>, TangentError> {
        // The product rule, without the terms whose factor does not move.
        let product = |name: &str, a: &[String]| {
            let terms =
                [(0, format!("{name}({}, {})", d[0], a[1])), (1, format!("{name}({}, {})", a[0], d[1]))];
            let moving = terms.into_iter().filter(|(i, _)| self.tangent(arguments[*i]).is_some());
            moving.map(|(_, term)| term).collect::<Vec<_>>().join(" + ")
        };
        let a = arguments.iter().map(|&h| self.value(h)).collect::<Result<Vec<_>, _>>()?;
        let value = self.value(result)?;
        const LN_2: f32 = std::f32::consts::LN_2;
        Ok(Some(match fun {
            M::Floor | M::Ceil | M::Round | M::Trunc | M::Sign | M::Step => return Ok(None),
            M::Abs => format!("sign({}) * {}", a[0], d[0]),
            M::Min => format!("select({}, {}, {} < {})", d[1], d[0], a[0], a[1]),
            M::Max => format!("select({}, {}, {} > {})", d[1], d[0], a[0], a[1]),
            M::Clamp => format!(
                "select(select({2}, {0}, {3} < {5}), {1}, {3} <= {4})",
                d[0], d[1], d[2], a[0], a[1], a[2]
            ),
            M::Fract => d[0].clone(),
            M::Dot => product("dot", &a),
            M::Cross => product("cross", &a),
            M::Mix => format!("mix({}, {}, {}) + ({} - {}) * {}", d[0], d[1], a[2], a[1], a[0], d[2]),
            M::Fma => format!("{} * {} + {} * {} + {}", d[0], a[1], a[0], d[1], d[2]),
            M::Sqrt => format!("0.5 * {} / {value}", d[0]),
            M::InverseSqrt => format!("-0.5 * {} * {value} / {}", d[0], a[0]),
            M::Exp => format!("{value} * {}", d[0]),
            M::Exp2 => format!("{LN_2:?}f * {value} * {}", d[0]),
            M::Log => format!("{} / {}", d[0], a[0]),
            M::Log2 => format!("{} / ({LN_2:?}f * {})", d[0], a[0]),
            M::Sin => format!("cos({}) * {}", a[0], d[0]),
            M::Cos => format!("-sin({}) * {}", a[0], d[0]),
            other => return Err(self.unsupported(format!("{other:?}"))),
        }))
    }
}

fn swizzle(size: VectorSize, pattern: &[naga::SwizzleComponent; 4]) -> String {
    pattern[..size as usize].iter().map(|&c| COMPONENTS[c as usize]).collect()
}

/// The name of a difference between neighbouring fragments or texels.
const fn slope_name(axis: DerivativeAxis, control: DerivativeControl) -> &'static str {
    use DerivativeAxis::{Width, X, Y};
    use DerivativeControl::{Coarse, Fine, None};
    match (axis, control) {
        (X, None) => "dpdx",
        (X, Coarse) => "dpdxCoarse",
        (X, Fine) => "dpdxFine",
        (Y, None) => "dpdy",
        (Y, Coarse) => "dpdyCoarse",
        (Y, Fine) => "dpdyFine",
        (Width, None) => "fwidth",
        (Width, Coarse) => "fwidthCoarse",
        (Width, Fine) => "fwidthFine",
    }
}

const fn operator(op: B) -> &'static str {
    match op {
        B::Add => "+",
        B::Subtract => "-",
        B::Multiply => "*",
        B::Divide => "/",
        B::Modulo => "%",
        B::Equal => "==",
        B::NotEqual => "!=",
        B::Less => "<",
        B::LessEqual => "<=",
        B::Greater => ">",
        B::GreaterEqual => ">=",
        B::And => "&",
        B::ExclusiveOr => "^",
        B::InclusiveOr => "|",
        B::LogicalAnd => "&&",
        B::LogicalOr => "||",
        B::ShiftLeft => "<<",
        B::ShiftRight => ">>",
    }
}

const fn function_name(fun: M) -> Option<&'static str> {
    Some(match fun {
        M::Abs => "abs",
        M::Min => "min",
        M::Max => "max",
        M::Clamp => "clamp",
        M::Cos => "cos",
        M::Sin => "sin",
        M::Ceil => "ceil",
        M::Floor => "floor",
        M::Round => "round",
        M::Fract => "fract",
        M::Trunc => "trunc",
        M::Exp => "exp",
        M::Exp2 => "exp2",
        M::Log => "log",
        M::Log2 => "log2",
        M::Pow => "pow",
        M::Dot => "dot",
        M::Cross => "cross",
        M::Sign => "sign",
        M::Fma => "fma",
        M::Mix => "mix",
        M::Step => "step",
        M::Sqrt => "sqrt",
        M::InverseSqrt => "inverseSqrt",
        _ => return None,
    })
}
