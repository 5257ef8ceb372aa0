// Places along a fragment at which a map is looked up, at the most.
//
// gives: texture_taps
// domain: texel, fragment
// when: trilinear
// cost: 0
fn one_texture_tap() -> f32 {
    return 1.0;
}
