//! Why a plan cannot be put as a graph.

use super::lower::LowerError;
use crate::shader::search::PlanError;
use crate::shader::tangent::TangentError;

/// A scene whose shading cannot be put as a graph.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error(transparent)]
pub enum ShadingError {
    /// No rules yield it.
    Plan(#[from] PlanError),
    /// A rule has no derivative.
    Tangent(#[from] TangentError),
    /// A rule cannot be computed on the processor.
    Lower(#[from] LowerError),
}
