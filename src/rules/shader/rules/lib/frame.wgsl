// One unit vector orthogonal to the unit vector n, the same on every evaluator (Duff et al., "Building an
// Orthonormal Basis, Revisited", JCGT 2017).
fn perpendicular(n: vec3f) -> vec3f {
    let side = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (side + n.z);
    return vec3f(1.0 + side * n.x * n.x * a, side * n.x * n.y * a, -side * n.x);
}

// The unit part of a tangent orthogonal to the unit normal (Gram-Schmidt), or one perpendicular to it
// where there is none.
fn orthogonal(tangent: vec3f, normal: vec3f) -> vec3f {
    let fallback = perpendicular(normal);
    let unit = normalize_or(tangent, fallback);
    let rest = unit - dot(unit, normal) * normal;
    // What is left of a parallel tangent is rounding, some 1e-7.
    return normalize_or(select(fallback, rest, dot(rest, rest) >= 1e-12), fallback);
}
