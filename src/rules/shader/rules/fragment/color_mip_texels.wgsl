// Albedo, linear Rec.709, filtered to the fragment in the shader.
//
// gives: albedo
// domain: texel, fragment
// when: has_color_map, !bilinear
// cost: 100
// uses: mip_texels
// reads: color_texels
fn albedo_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> vec3f {
    return sample_mip_texels(color_texels, vertex_uv, uv_steps, texture_taps).rgb;
}
