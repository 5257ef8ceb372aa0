// The normal of lookups in the environment's frame: Ry(r)^-1 d (MODEL 1).
//
// gives: n_in_environment
// domain: texel, fragment
// when: turned
// cost: 5
fn turned_n(lookup_normal: vec3f, turn: vec2f) -> vec3f {
    let n: vec3f = lookup_normal;
    return vec3f(turn.x * n.x - turn.y * n.z, n.y, turn.y * n.x + turn.x * n.z);
}
