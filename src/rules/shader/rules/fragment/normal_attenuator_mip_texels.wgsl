// Normal map and attenuator from one map, packed when it is loaded; filtered to the fragment in the shader.
//
// gives: normal_texel.xyz, attenuator.w
// domain: texel, fragment
// when: normal_attenuator_one_size, !bilinear
// cost: 104
// uses: mip_texels
// reads: normal_attenuator_texels
fn normal_and_attenuator_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> vec4f {
    return sample_mip_texels(normal_attenuator_texels, vertex_uv, uv_steps, texture_taps);
}
