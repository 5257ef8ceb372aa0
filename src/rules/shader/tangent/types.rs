//! Types of WGSL, by name, and which of them move.

use naga::{Scalar, ScalarKind, TypeInner};

/// The WGSL name of a scalar or vector type.
pub(super) fn type_name(inner: &TypeInner) -> Option<String> {
    let letter = |scalar: Scalar| match (scalar.kind, scalar.width) {
        (ScalarKind::Float, 4) => Some(("f", "f32")),
        (ScalarKind::Sint, 4) => Some(("i", "i32")),
        (ScalarKind::Uint, 4) => Some(("u", "u32")),
        (ScalarKind::Bool, _) => Some(("<bool>", "bool")),
        _ => None,
    };
    match *inner {
        TypeInner::Scalar(scalar) => letter(scalar).map(|(_, name)| name.to_owned()),
        TypeInner::Vector { size, scalar } => letter(scalar).map(|(l, _)| format!("vec{}{l}", size as u8)),
        _ => None,
    }
}

/// Whether values of the type can move: 32-bit floats.
pub(super) fn is_float(inner: &TypeInner) -> bool {
    inner.scalar_kind() == Some(ScalarKind::Float)
}
