// The side-specular intensity s, filtered by the hardware; stored in 8 bits.
//
// gives: specular
// domain: texel, fragment
// when: has_specular_map, bilinear
// cost: 8
// error: 0.004
// paper: yes
// reads: specular_map, map_sampler
fn specular_from_map(vertex_uv: vec2f) -> f32 {
    return textureSampleLevel(specular_map, map_sampler, vertex_uv, 0.0).r;
}
