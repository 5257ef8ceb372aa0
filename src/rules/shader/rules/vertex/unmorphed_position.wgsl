// gives: morphed_position
// when: !morphs
// cost: 0
fn unmorphed_position(rest_position: vec3f) -> vec3f {
    return rest_position;
}
