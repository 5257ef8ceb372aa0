// The hilite attenuator a, filtered by the hardware; stored in 8 bits.
//
// gives: attenuator
// when: has_attenuator_map, bilinear
// cost: 8
// error: 0.004
// paper: yes
// reads: attenuator_map, map_sampler
fn attenuator_from_map(vertex_uv: vec2f) -> f32 {
    return textureSampleLevel(attenuator_map, map_sampler, vertex_uv, 0.0).r;
}
