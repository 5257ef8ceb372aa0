// B = w cross(N, T) (MODEL 2).
//
// gives: vertex_bitangent
// cost: 18
// uses: vector
fn frame_bitangent(vertex_tangent: vec3f, vertex_normal: vec3f, rest_tangent: vec4f) -> vec3f {
    return rest_tangent.w * normalize_or(cross(vertex_normal, vertex_tangent), vertex_tangent);
}
