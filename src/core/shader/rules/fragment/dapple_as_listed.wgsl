// S.w, signed (listing 3-3).
//
// gives: dapple
// when: listing, raster
// cost: 0
fn signed_dapple(vertex_normal: vec3f) -> f32 {
    return vertex_normal.z;
}
