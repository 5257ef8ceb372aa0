// The hilite attenuator a, filtered in the shader.
//
// gives: attenuator
// when: has_attenuator_map, bilinear
// cost: 34
// uses: texels
// reads: attenuator_texels
fn attenuator_from_texels(vertex_uv: vec2f) -> f32 {
    return sample_texels(attenuator_texels, vertex_uv).r;
}
