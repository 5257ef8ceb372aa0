// The normal map's texel, in [0, 1], filtered by the hardware; stored in 8 bits.
//
// gives: normal_texel
// domain: texel, fragment
// when: has_normal_map, bilinear
// cost: 8
// error: 0.004
// paper: yes
// reads: normal_map, map_sampler
fn normal_texel_from_map(vertex_uv: vec2f) -> vec3f {
    return textureSampleLevel(normal_map, map_sampler, vertex_uv, 0.0).xyz;
}
