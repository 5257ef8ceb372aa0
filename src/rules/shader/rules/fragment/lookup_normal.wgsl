// The cubes are looked up along the normal-mapped n (listing 3-4).
//
// gives: lookup_normal
// domain: texel, fragment
// when: !smooth_lookups
// cost: 0
fn lookups_along_n(n: vec3f) -> vec3f {
    return n;
}
