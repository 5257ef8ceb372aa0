// R = V (n.V) - 2 n (listing 3-4).
//
// gives: reflected
// when: listing
// cost: 9
fn mirror_direction_as_listed(lookup_normal: vec3f, view: vec3f) -> vec3f {
    return dot(lookup_normal, view) * view - 2.0 * lookup_normal;
}
