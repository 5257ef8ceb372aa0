// The side-specular intensity s, filtered to the fragment in the shader.
//
// gives: specular
// domain: texel, fragment
// when: has_specular_map, !bilinear
// cost: 100
// uses: mip_texels
// reads: specular_texels
fn specular_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> f32 {
    return sample_mip_texels(specular_texels, vertex_uv, uv_steps, texture_taps).r;
}
