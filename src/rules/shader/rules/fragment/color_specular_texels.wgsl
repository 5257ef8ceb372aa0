// Albedo and side-specular intensity from one map, packed when it is loaded; filtered in the shader.
//
// gives: albedo.xyz, specular.w
// domain: texel, fragment
// when: color_specular_one_size, bilinear
// cost: 36
// uses: texels
// reads: color_specular_texels
fn albedo_and_specular_from_texels(vertex_uv: vec2f) -> vec4f {
    return sample_texels(color_specular_texels, vertex_uv);
}
