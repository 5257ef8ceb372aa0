// N through the bones: their upper 3x3 as listed, its inverse transpose where a bone scales unevenly
// (MODEL 2).
//
// gives: vertex_normal
// when: bones
// cost: 60
// uses: vector
// reads: bones
fn skin_normal(morphed_normal: vec3f, joints: vec4u, joint_weights: vec4f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let bone = 6u * joints[i] + 3u;
        let n = morphed_normal;
        sum += joint_weights[i]
            * vec3f(dot(bones[bone].xyz, n), dot(bones[bone + 1u].xyz, n), dot(bones[bone + 2u].xyz, n));
    }
    return normalize_or(sum, morphed_normal);
}
