// The view in the environment's frame: Ry(r)^-1 d (MODEL 1).
//
// gives: view_in_environment
// when: turned
// cost: 5
fn turned_view(view: vec3f, turn: vec2f) -> vec3f {
    return vec3f(turn.x * view.x - turn.y * view.z, view.y, turn.y * view.x + turn.x * view.z);
}
