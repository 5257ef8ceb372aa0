// S.z of each corner of the triangle: what was interpolated of it by the corner's share. One that counts nothing may be
// anything in [0, 1].
//
// gives: corner_silhouettes
// when: raster
// cost: 9
fn silhouettes_of_corners(vertex_silhouettes: vec3f, vertex_share: vec3f) -> vec3f {
    return clamp(vertex_silhouettes / max(vertex_share, vec3f(1e-20)), vec3f(0.0), vec3f(1.0));
}
