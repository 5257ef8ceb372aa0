// The part of a texel's shading normal that the normal map's strength leaves alone; nothing where it is not finite.
//
// gives: base
// when: bumped
// cost: 6
// uses: vector
fn base_at_texel(decoded: vec3f, vertex_normal: vec3f) -> vec3f {
    let base: vec3f = decoded.z * vertex_normal;
    return select(vec3f(0.0), base, is_finite(base));
}
