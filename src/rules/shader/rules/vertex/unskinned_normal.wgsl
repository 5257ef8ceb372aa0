// gives: vertex_normal
// when: !bones
// cost: 0
fn unskinned_normal(morphed_normal: vec3f) -> vec3f {
    return morphed_normal;
}
