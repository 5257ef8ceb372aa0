//! How `environment_rotation` turns the environment about the world's +Y.

use super::params::{Param, Params};
use super::real::Real;
use super::vector::V3;

/// The cosine and the sine of the turn.
#[must_use]
pub fn turn(params: &Params) -> [f64; 2] {
    let (sin, cos) = params.scalar(Param::EnvironmentRotation).to_radians().sin_cos();
    [cos, sin]
}

/// A direction of the world in the environment that is turned so.
#[must_use]
pub fn in_environment<R: Real>([cos, sin]: [R; 2], [x, y, z]: V3<R>) -> V3<R> {
    [cos * x - sin * z, y, sin * x + cos * z]
}
