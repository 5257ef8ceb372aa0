// The hilite attenuator a, filtered to the fragment in the shader.
//
// gives: attenuator
// when: has_attenuator_map, !bilinear
// cost: 100
// uses: mip_texels
// reads: attenuator_texels
fn attenuator_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> f32 {
    return sample_mip_texels(attenuator_texels, vertex_uv, uv_steps, texture_taps).r;
}
