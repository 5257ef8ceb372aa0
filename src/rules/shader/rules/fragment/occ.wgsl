// occ = 1 - occlusion (1 - S.x) (MODEL 3).
//
// gives: occ
// domain: texel, fragment
// when: occlusion
// cost: 2
fn occluded_share(open: f32, occlusion: f32) -> f32 {
    return 1.0 - occlusion * (1.0 - open);
}
