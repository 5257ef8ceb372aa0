// Albedo, linear Rec.709, filtered by the hardware; stored in 8 bits.
//
// gives: albedo
// domain: texel, fragment
// when: has_color_map, bilinear
// cost: 8
// error: 0.004
// paper: yes
// reads: color_map, map_sampler
fn albedo_from_map(vertex_uv: vec2f) -> vec3f {
    return textureSampleLevel(color_map, map_sampler, vertex_uv, 0.0).rgb;
}
