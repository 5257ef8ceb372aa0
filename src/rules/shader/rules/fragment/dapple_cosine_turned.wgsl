// S.w: the third row of DappleXf times N in the environment's frame, Ry(r)^-1 N (MODEL 1 and 2).
//
// gives: dapple_cosine
// when: dapple_turned
// cost: 10
fn dapple_along_turned_axis(dapple_normal: vec3f, dapple_axis: vec3f, turn: vec2f) -> f32 {
    let n: vec3f = dapple_normal;
    return dot(dapple_axis, vec3f(turn.x * n.x - turn.y * n.z, n.y, turn.y * n.x + turn.x * n.z));
}
