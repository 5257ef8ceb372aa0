// Places along a fragment at which a map is looked up, at the most: where the surface is seen at a grazing angle. The cost
// is that of three more places, as on a surface seen at some 15 degrees.
//
// gives: texture_taps
// domain: texel, fragment
// when: anisotropic
// cost: 200
fn texture_taps_along() -> f32 {
    return 16.0;
}
