// Albedo and side-specular intensity from one 8-bit map, packed when it is loaded; filtered by the hardware.
//
// gives: albedo.xyz, specular.w
// domain: texel, fragment
// when: color_specular_one_size, bilinear
// cost: 9
// error: 0.004
// paper: yes
// reads: color_specular_map, map_sampler
fn albedo_and_specular_from_map(vertex_uv: vec2f) -> vec4f {
    return textureSampleLevel(color_specular_map, map_sampler, vertex_uv, 0.0);
}
