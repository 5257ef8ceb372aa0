// S.w: light that falls through leaves from +Z (listing 3-3 with the identity as DappleXf).
//
// gives: dapple_cosine
// when: dapple_ahead, !dapple_turned
// cost: 0
fn dapple_from_ahead(dapple_normal: vec3f) -> f32 {
    return dapple_normal.z;
}
