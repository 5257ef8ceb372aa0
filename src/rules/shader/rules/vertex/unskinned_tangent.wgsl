// gives: skinned_tangent
// when: !bones
// cost: 0
fn unskinned_tangent(morphed_tangent: vec3f) -> vec3f {
    return morphed_tangent;
}
