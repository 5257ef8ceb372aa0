// Normal map and attenuator from one 8-bit map, packed when it is loaded; filtered to the fragment by the hardware.
//
// gives: normal_texel.xyz, attenuator.w
// domain: texel, fragment
// when: normal_attenuator_one_size, !bilinear
// cost: 15
// error: 0.006
// paper: yes
// reads: normal_attenuator_map, map_sampler
fn normal_and_attenuator_from_mip_map(vertex_uv: vec2f) -> vec4f {
    return textureSample(normal_attenuator_map, map_sampler, vertex_uv);
}
