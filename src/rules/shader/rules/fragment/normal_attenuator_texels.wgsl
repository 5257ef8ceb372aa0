// Normal map and attenuator from one map, packed when it is loaded; filtered in the shader.
//
// gives: normal_texel.xyz, attenuator.w
// domain: texel, fragment
// when: normal_attenuator_one_size, bilinear
// cost: 36
// uses: texels
// reads: normal_attenuator_texels
fn normal_and_attenuator_from_texels(vertex_uv: vec2f) -> vec4f {
    return sample_texels(normal_attenuator_texels, vertex_uv);
}
