// The cubes are looked up along the smooth N: the key light alone shows bumps (GPU Gems chapter 3, last page).
//
// gives: lookup_normal
// domain: texel, fragment
// when: smooth_lookups
// cost: 0
fn lookups_along_smooth_normal(normal: vec3f) -> vec3f {
    return normal;
}
