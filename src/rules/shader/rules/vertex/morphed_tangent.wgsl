// T made orthogonal to N before the bones (listing 3-3).
//
// gives: morphed_tangent
// cost: 30
// uses: vector, frame
fn morphed_tangent(rest_tangent: vec4f, morphed_normal: vec3f) -> vec3f {
    return orthogonal(rest_tangent.xyz, morphed_normal);
}
