// The normal map's texel, in [0, 1], filtered to the fragment in the shader.
//
// gives: normal_texel
// domain: texel, fragment
// when: has_normal_map, !bilinear
// cost: 100
// uses: mip_texels
// reads: normal_texels
fn normal_texel_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> vec3f {
    return sample_mip_texels(normal_texels, vertex_uv, uv_steps, texture_taps).xyz;
}
