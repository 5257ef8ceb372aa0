// The normal map's texel, in [0, 1], filtered to the fragment by the hardware; stored in 8 bits.
//
// gives: normal_texel
// domain: texel, fragment
// when: has_normal_map, !bilinear
// cost: 14
// error: 0.006
// paper: yes
// reads: normal_map, map_sampler
fn normal_texel_from_mip_map(vertex_uv: vec2f) -> vec3f {
    return textureSample(normal_map, map_sampler, vertex_uv).xyz;
}
