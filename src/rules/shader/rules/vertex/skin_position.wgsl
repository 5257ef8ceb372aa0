// Four weighted bones (listing 3-3).
//
// gives: vertex_position
// when: bones
// cost: 60
// reads: bones
fn skin_position(morphed_position: vec3f, joints: vec4u, joint_weights: vec4f) -> vec3f {
    let x = vec4f(morphed_position, 1.0);
    var sum = vec3f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let bone = 6u * joints[i];
        sum += joint_weights[i] * vec3f(dot(bones[bone], x), dot(bones[bone + 1u], x), dot(bones[bone + 2u], x));
    }
    return sum;
}
