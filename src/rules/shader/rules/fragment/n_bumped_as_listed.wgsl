// n = TBN t, not normalised (listing 3-4).
//
// gives: n
// domain: texel, fragment
// when: bumped, listing
// cost: 3
fn bumped_normal_as_listed(base: vec3f, bump: vec3f, normal_strength: f32) -> vec3f {
    return base + normal_strength * bump;
}
