// Albedo and side-specular intensity from one map, packed when it is loaded; filtered to the fragment in the shader.
//
// gives: albedo.xyz, specular.w
// domain: texel, fragment
// when: color_specular_one_size, !bilinear
// cost: 104
// uses: mip_texels
// reads: color_specular_texels
fn albedo_and_specular_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> vec4f {
    return sample_mip_texels(color_specular_texels, vertex_uv, uv_steps, texture_taps);
}
