// The smooth normal N of unit length at a texel; +Y where it vanishes, as nobody sees a texel (MODEL 7).
//
// gives: normal
// cost: 10
// uses: vector
fn normal_of_texel(vertex_normal: vec3f) -> vec3f {
    return normalize_or(vertex_normal, vec3f(0.0, 1.0, 0.0));
}
