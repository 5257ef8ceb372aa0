// normalize_or along (dv, d_fallback): d (v / |v|) = (dv - u (u . dv)) / |v|, at most 1e6 in each component, as
// on the CPU: beyond, squares of derivatives overflow.
fn normalize_or_tangent(v: vec3f, fallback: vec3f, dv: vec3f, d_fallback: vec3f) -> vec3f {
    let largest: f32 = max(max(abs(v.x), abs(v.y)), abs(v.z));
    let ok: bool = largest >= 1e-37 && is_finite(v);
    let scale: f32 = select(1.0, largest, ok);
    let u: vec3f = select(vec3f(1.0, 0.0, 0.0), v / scale, ok);
    let inverse: f32 = inverseSqrt(dot(u, u));
    let n: vec3f = u * inverse;
    let across: vec3f = dv * inverse;
    let most = vec3f(1e6 * scale);
    let turning: vec3f = clamp(across - dot(n, across) * n, -most, most) / scale;
    return select(d_fallback, turning, ok);
}
