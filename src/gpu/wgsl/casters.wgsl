// What has holes or blends, in shadow maps: fragments are left out where light goes through, as rays do (`bake::cutouts`).

// Cells along a triangle's side, each with one threshold: finer than a map's texels.
const CELLS = 4096.0;

struct CastVaryings {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
    @location(1) tint: vec4f,
    // Weights of the second and the third corner.
    @location(2) shares: vec2f,
    @location(3) @interpolate(flat) triangle: u32,
}

// Above this alpha what blends stops light there (Wyman and McGuire 2017, Hashed Alpha Testing).
fn threshold(at: CastVaryings) -> f32 {
    let cell = vec2u(clamp(at.shares, vec2f(0.0), vec2f(1.0)) * CELLS);
    return f32(hashed(at.triangle ^ hashed(cell.x ^ hashed(cell.y))) >> 8u) / 16777216.0;
}

@fragment
fn cast_fragment(at: CastVaryings) {
    let alpha = clamp(base_color(at.uv, at.tint).a, 0.0, 1.0);
    let blends = material.factors.z > 1.5;
    if (select(alpha >= material.emission.a, alpha > threshold(at), blends)) {
        return;
    }
    discard;
}
