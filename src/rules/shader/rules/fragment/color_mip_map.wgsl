// Albedo, linear Rec.709, filtered to the fragment by the hardware; stored in 8 bits.
//
// gives: albedo
// domain: texel, fragment
// when: has_color_map, !bilinear
// cost: 14
// error: 0.006
// paper: yes
// reads: color_map, map_sampler
fn albedo_from_mip_map(vertex_uv: vec2f) -> vec3f {
    return textureSample(color_map, map_sampler, vertex_uv).rgb;
}
