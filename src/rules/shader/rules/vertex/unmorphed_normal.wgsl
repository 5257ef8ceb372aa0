// A vertex without a normal has +Z (MODEL 7).
//
// gives: morphed_normal
// when: !morphs
// cost: 9
// uses: vector
fn unmorphed_normal(rest_normal: vec3f) -> vec3f {
    return normalize_or(rest_normal, vec3f(0.0, 0.0, 1.0));
}
