// Whether no component is NaN or infinite, asked in a way that compilers do not assume away.
fn is_finite(v: vec3f) -> bool {
    let bits: vec3u = bitcast<vec3u>(v) & vec3u(0x7f800000u);
    return bits.x != 0x7f800000u && bits.y != 0x7f800000u && bits.z != 0x7f800000u;
}

// Whether every component is 0.
fn is_zero(v: vec3f) -> bool {
    return v.x == 0.0 && v.y == 0.0 && v.z == 0.0;
}

// v / |v| without under- or overflow; the fallback where v is zero or not finite (MODEL 7).
fn normalize_or(v: vec3f, fallback: vec3f) -> vec3f {
    let largest: f32 = max(max(abs(v.x), abs(v.y)), abs(v.z));
    // Below 1e-37 the reciprocal would overflow; such a vector is noise.
    let ok: bool = largest >= 1e-37 && is_finite(v);
    let u: vec3f = select(vec3f(1.0, 0.0, 0.0), v / select(1.0, largest, ok), ok);
    return select(fallback, u / sqrt(dot(u, u)), ok);
}
