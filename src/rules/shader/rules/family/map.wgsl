// MEANING, filtered in the shader.
//
// gives: NAME
// domain: texel, fragment
// when: has_NAME_map, bilinear
// cost: 34
// uses: texels
// reads: NAME_texels
fn NAME_from_texels(vertex_uv: vec2f) -> TYPE {
    return sample_texels(NAME_texels, vertex_uv).CHANNELS;
}

// MEANING, filtered by the hardware; stored in 16 bits.
//
// gives: NAME
// domain: texel, fragment
// when: has_NAME_map, bilinear
// cost: 8
// error: 0.004
// paper: yes
// reads: NAME_map, map_sampler
fn NAME_from_map(vertex_uv: vec2f) -> TYPE {
    return textureSampleLevel(NAME_map, map_sampler, vertex_uv, 0.0).CHANNELS;
}

// MEANING, filtered to the fragment in the shader.
//
// gives: NAME
// domain: texel, fragment
// when: has_NAME_map, !bilinear
// cost: 100
// uses: mip_texels
// reads: NAME_texels
fn NAME_from_mip_texels(vertex_uv: vec2f, uv_steps: vec4f, texture_taps: f32) -> TYPE {
    return sample_mip_texels(NAME_texels, vertex_uv, uv_steps, texture_taps).CHANNELS;
}

// MEANING, filtered to the fragment by the hardware; stored in 16 bits.
//
// gives: NAME
// domain: texel, fragment
// when: has_NAME_map, !bilinear
// cost: 14
// error: 0.006
// paper: yes
// reads: NAME_map, map_sampler
fn NAME_from_mip_map(vertex_uv: vec2f) -> TYPE {
    return textureSample(NAME_map, map_sampler, vertex_uv).CHANNELS;
}

// MEANING: neutral, as the scene has no map.
//
// gives: NAME
// domain: texel, fragment
// when: !has_NAME_map, raster
// cost: 0
fn NAME_neutral() -> TYPE {
    return TYPE(NEUTRAL);
}
