// gives: clip
// cost: 16
fn clip_position(vertex_position: vec3f, view_projection: mat4x4f) -> vec4f {
    return view_projection * vec4f(vertex_position, 1.0);
}
