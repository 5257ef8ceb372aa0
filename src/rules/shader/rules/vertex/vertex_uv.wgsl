// gives: vertex_uv
// cost: 0
fn vertex_texture_coordinates(rest_uv: vec2f) -> vec2f {
    return rest_uv;
}
