// Without ambient occlusion everything is open.
//
// gives: occ
// domain: texel, fragment
// when: !occlusion
// cost: 0
fn unoccluded() -> f32 {
    return 1.0;
}
