// Texture coordinates of the UV atlas' own.
//
// gives: vertex_atlas_uv
// when: own_atlas_uvs
// cost: 0
fn atlas_coordinates(rest_atlas_uv: vec2f) -> vec2f {
    return rest_atlas_uv;
}
