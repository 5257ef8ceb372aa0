// T, unless it came out parallel to N.
//
// gives: vertex_tangent
// cost: 12
// uses: vector, frame
fn frame_tangent(skinned_tangent: vec3f, vertex_normal: vec3f) -> vec3f {
    let across = cross(vertex_normal, skinned_tangent);
    return select(perpendicular(vertex_normal), skinned_tangent, dot(across, across) >= 1e-12);
}
