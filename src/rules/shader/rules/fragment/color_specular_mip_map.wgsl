// Albedo and side-specular intensity from one 8-bit map, packed when it is loaded; filtered to the fragment by the
// hardware.
//
// gives: albedo.xyz, specular.w
// domain: texel, fragment
// when: color_specular_one_size, !bilinear
// cost: 15
// error: 0.006
// paper: yes
// reads: color_specular_map, map_sampler
fn albedo_and_specular_from_mip_map(vertex_uv: vec2f) -> vec4f {
    return textureSample(color_specular_map, map_sampler, vertex_uv);
}
