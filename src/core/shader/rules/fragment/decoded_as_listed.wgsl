// The texel as it is (listing 3-4).
//
// gives: decoded
// when: listing, bumped
// cost: 0
fn texel_as_listed(normal_texel: vec3f) -> vec3f {
    return normal_texel;
}
