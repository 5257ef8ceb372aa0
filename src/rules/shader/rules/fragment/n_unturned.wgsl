// The normal of lookups in the environment's frame, which is not turned.
//
// gives: n_in_environment
// domain: texel, fragment
// when: !turned
// cost: 0
fn unturned_n(lookup_normal: vec3f) -> vec3f {
    return lookup_normal;
}
