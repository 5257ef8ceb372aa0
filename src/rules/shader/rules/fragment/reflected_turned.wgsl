// The reflection in the environment's frame: Ry(r)^-1 d (MODEL 1).
//
// gives: reflected_in_environment
// when: turned
// cost: 5
fn turned_reflected(reflected: vec3f, turn: vec2f) -> vec3f {
    return vec3f(turn.x * reflected.x - turn.y * reflected.z, reflected.y, turn.y * reflected.x + turn.x * reflected.z);
}
