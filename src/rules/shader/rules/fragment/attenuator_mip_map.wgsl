// The hilite attenuator a, filtered to the fragment by the hardware; stored in 8 bits.
//
// gives: attenuator
// when: has_attenuator_map, !bilinear
// cost: 14
// error: 0.006
// paper: yes
// reads: attenuator_map, map_sampler
fn attenuator_from_mip_map(vertex_uv: vec2f) -> f32 {
    return textureSample(attenuator_map, map_sampler, vertex_uv).r;
}
