// The reflection in the environment's frame, which is not turned.
//
// gives: reflected_in_environment
// when: !turned
// cost: 0
fn unturned_reflected(reflected: vec3f) -> vec3f {
    return reflected;
}
