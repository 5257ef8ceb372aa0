// The smooth normal N of unit length; -V where it vanishes (MODEL 7).
//
// gives: normal
// when: raster
// cost: 10
// uses: vector
fn smooth_normal(vertex_normal: vec3f, view: vec3f) -> vec3f {
    return normalize_or(vertex_normal, -view);
}
