// The side-specular intensity s, filtered in the shader.
//
// gives: specular
// domain: texel, fragment
// when: has_specular_map, bilinear
// cost: 34
// uses: texels
// reads: specular_texels
fn specular_from_texels(vertex_uv: vec2f) -> f32 {
    return sample_texels(specular_texels, vertex_uv).r;
}
