// T through the bones (listing 3-3).
//
// gives: skinned_tangent
// when: bones
// cost: 60
// uses: vector, frame
// reads: bones
fn skin_tangent(morphed_tangent: vec3f, vertex_normal: vec3f, joints: vec4u, joint_weights: vec4f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let bone = 6u * joints[i];
        let t = morphed_tangent;
        sum += joint_weights[i]
            * vec3f(dot(bones[bone].xyz, t), dot(bones[bone + 1u].xyz, t), dot(bones[bone + 2u].xyz, t));
    }
    return normalize_or(sum, perpendicular(vertex_normal));
}
