// Albedo, linear Rec.709, filtered in the shader.
//
// gives: albedo
// domain: texel, fragment
// when: has_color_map, bilinear
// cost: 34
// uses: texels
// reads: color_texels
fn albedo_from_texels(vertex_uv: vec2f) -> vec3f {
    return sample_texels(color_texels, vertex_uv).rgb;
}
