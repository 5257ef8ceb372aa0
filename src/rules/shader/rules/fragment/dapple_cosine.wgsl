// S.w: the third row of DappleXf times N (listing 3-3).
//
// gives: dapple_cosine
// when: !dapple_turned
// cost: 5
fn dapple_along_axis(dapple_normal: vec3f, dapple_axis: vec3f) -> f32 {
    return dot(dapple_axis, dapple_normal);
}
