// gives: vertex_occlusion
// when: !morphs
// cost: 0
fn unmorphed_occlusion(rest_occlusion: f32) -> f32 {
    return rest_occlusion;
}
