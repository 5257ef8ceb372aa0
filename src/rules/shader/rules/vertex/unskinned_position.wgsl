// gives: vertex_position
// when: !bones
// cost: 0
fn unskinned_position(morphed_position: vec3f) -> vec3f {
    return morphed_position;
}
