
// The share of the light NAME that one comparison with its shadow map lets through, blended over four texels.
//
// gives: light_NAME_seen
// domain: texel, fragment
// when: raster, shadow_maps, shadow_hardware
// named: yes
// error: 0.012
// uses: vector, shadow
// reads: shadow_maps, shadow_sampler, shadow_views
// cost: 70
fn light_NAME_compared(
    vertex_position: vec3f,
    vertex_normal: vec3f,
    light_NAME_toward: vec3f,
    light_NAME_shadow_map: f32,
) -> f32 {
    return shadow_compared(light_NAME_shadow_map, vertex_position, vertex_normal, light_NAME_toward);
}

// The share that several comparisons around the place let through (percentage-closer filtering).
//
// gives: light_NAME_seen
// domain: texel, fragment
// when: raster, shadow_maps, shadow_pcf
// named: yes
// error: 0.011
// uses: vector, shadow
// reads: shadow_maps, shadow_sampler, shadow_views
// cost: 90 and 40 a tap
fn light_NAME_filtered(
    vertex_position: vec3f,
    vertex_normal: vec3f,
    light_NAME_toward: vec3f,
    light_NAME_shadow_map: f32,
) -> f32 {
    return shadow_filtered(light_NAME_shadow_map, vertex_position, vertex_normal, light_NAME_toward);
}

// The same within a radius that follows from the width of the light and how far away its blockers are
// (percentage-closer soft shadows).
//
// gives: light_NAME_seen
// domain: texel, fragment
// when: raster, shadow_maps, shadow_pcss
// named: yes
// error: 0.01
// uses: vector, shadow
// reads: shadow_maps, shadow_sampler, shadow_views
// cost: 140 and 80 a tap
fn light_NAME_softened(
    vertex_position: vec3f,
    vertex_normal: vec3f,
    light_NAME_toward: vec3f,
    light_NAME_shadow_map: f32,
) -> f32 {
    return shadow_softened(light_NAME_shadow_map, vertex_position, vertex_normal, light_NAME_toward);
}

// How far the light NAME travels inside, in millimetres: how much further from it than what its shadow map shows (a
// translucent shadow map; Dachsbacher and Stamminger 2003).
//
// gives: light_NAME_inside
// when: raster, lights, transmission, translucent_maps
// named: yes
// error: 0.01
// uses: vector, shadow
// reads: shadow_maps, shadow_sampler, shadow_views
// cost: 60
fn light_NAME_mapped_inside(
    vertex_position: vec3f,
    vertex_normal: vec3f,
    light_NAME_shadow_map: f32,
    millimetres: f32,
) -> f32 {
    return millimetres * shadow_depth(light_NAME_shadow_map, vertex_position, vertex_normal);
}
