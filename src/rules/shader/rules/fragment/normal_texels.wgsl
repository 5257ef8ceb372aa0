// The normal map's texel, in [0, 1], filtered in the shader.
//
// gives: normal_texel
// domain: texel, fragment
// when: has_normal_map, bilinear
// cost: 34
// uses: texels
// reads: normal_texels
fn normal_texel_from_texels(vertex_uv: vec2f) -> vec3f {
    return sample_texels(normal_texels, vertex_uv).xyz;
}
