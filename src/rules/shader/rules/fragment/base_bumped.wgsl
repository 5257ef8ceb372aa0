// The part of the shading normal that the normal map's strength leaves alone.
//
// gives: base
// when: bumped, raster
// cost: 6
// uses: vector
fn base_of_texel(decoded: vec3f, vertex_normal: vec3f, view: vec3f) -> vec3f {
    let base: vec3f = decoded.z * vertex_normal;
    return select(base, -view, abs(base.x) + abs(base.y) + abs(base.z) < 1e-37 || !is_finite(base));
}
