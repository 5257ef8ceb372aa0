//! Vertices: N, T or both without a direction, parallel, or not finite.

use crate::stability::case::VertexInputs;

/// A named case of a vertex.
pub struct HardFrame {
    /// Its name in tables.
    pub name: &'static str,
    /// The vertex.
    pub vertex: VertexInputs,
}

/// Every case of vertices.
#[must_use]
pub fn frames() -> Vec<HardFrame> {
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let (x, z) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let frame = |name, normal, tangent| {
        [1.0, -1.0].map(|handedness| HardFrame { name, vertex: VertexInputs { normal, tangent, handedness } })
    };
    [
        frame("vertex without N and T", [0.0; 3], [0.0; 3]),
        frame("vertex without N", [0.0; 3], x),
        frame("vertex without T", z, [0.0; 3]),
        frame("vertex without T", [0.0, 0.0, -1.0], [0.0; 3]),
        frame("vertex whose T is N", z, z),
        frame("vertex whose T is N", x, [-1.0, 0.0, 0.0]),
        frame("vertex whose T is all but N", z, [1e-20, 0.0, -3.0]),
        frame("vertex of tiny vectors", [0.0, 1e-30, 1e-30], [1e-36, 0.0, 0.0]),
        frame("vertex of denormals", [0.0, 0.0, 1e-40], [1e-42, 0.0, 0.0]),
        frame("vertex of huge vectors", [0.0, 1e30, 1e30], [1e37, 0.0, 0.0]),
        frame("vertex that is not finite", [nan, 0.0, 0.0], [inf, 0.0, 0.0]),
    ]
    .into_iter()
    .flatten()
    .collect()
}
