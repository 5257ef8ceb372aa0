// The side-specular intensity s, filtered to the fragment by the hardware; stored in 8 bits.
//
// gives: specular
// domain: texel, fragment
// when: has_specular_map, !bilinear
// cost: 14
// error: 0.006
// paper: yes
// reads: specular_map, map_sampler
fn specular_from_mip_map(vertex_uv: vec2f) -> f32 {
    return textureSample(specular_map, map_sampler, vertex_uv).r;
}
