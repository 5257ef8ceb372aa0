// Barycentric coordinates: what each corner of the triangle counts.
//
// gives: corner_shares
// when: raster
// cost: 0
fn interpolated_shares(vertex_share: vec3f) -> vec3f {
    return vertex_share;
}
