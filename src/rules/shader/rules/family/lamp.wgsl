// Light of a lamp that stands somewhere, a point or a spot (MODEL 8; glTF's KHR_lights_punctual).
//
// effect: light_NAME within lights, the light NAME
// parameter: light.NAME.color = 1 in [0, inf), rgb, linear, scene, weighs light_NAME; factor on the light's intensity; KHR_lights_punctual
// parameter: light.NAME.irradiance = 0 in [0, inf), rgb, held; irradiance of a facing surface at distance 1; KHR_lights_punctual
// parameter: light.NAME.position = 0 in [-inf, inf], rgb, held; where it stands; KHR_lights_punctual
// parameter: light.NAME.axis = 0 in [-1, 1], rgb, held; unit vector that a spot shines along; KHR_lights_punctual
// parameter: light.NAME.cone = 0 in [-2, 1], rgb, held; cosines of a spot's inner and outer angle; KHR_lights_punctual
// parameter: light.NAME.range = 0 in [0, inf), held; where its light ends, 0 where it never does; KHR_lights_punctual
// parameter: light.NAME.shadow_map = -1 in [-1, inf], held; first layer of its shadow map, -1 where it has none; Williams 1978
// sample_field: light_NAME_found_toward: vec3f = 0; unit vector towards the light NAME
// sample_field: light_NAME_found_arriving: f32 = 0; what distance, cone and shadow leave of the light NAME
// sample_field: light_NAME_open: f32 = 1; share of the light NAME that nothing stops
// sample_field: light_NAME_depth: f32 = 4000; millimetres to the surface that faces the light NAME
// sample_field: light_NAME_far: f32 = 1; share of the light NAME that arrives at that surface
// sample_field: light_NAME_far_light: vec3f = 0; what arrives of the light NAME where rays inward leave, weakened on the way
// sample_field: light_NAME_far_light_0: vec3f = 0; what arrives of the light NAME where rays inward leave after 0, 0.1 and 0.2 mm
// sample_field: light_NAME_far_light_1: vec3f = 0; what arrives of the light NAME where rays inward leave after 0.4, 0.8 and 1.5 mm
// sample_field: light_NAME_far_light_2: vec3f = 0; what arrives of the light NAME where rays inward leave after 3, 5.5 and 10 mm
// sample_field: light_NAME_far_light_3: vec3f = 0; what arrives of the light NAME where rays inward leave after 18, 32 and 50 mm
// sample_field: light_NAME_found_beyond: f32 = 0; what distance, cone and, at that surface, shadow leave of the light NAME

// The unit vector towards it, as stored samples hold it.
//
// gives: light_NAME_toward
// when: !raster
// cost: 0
fn light_NAME_found_direction(light_NAME_found_toward: vec3f) -> vec3f {
    return light_NAME_found_toward;
}

// What arrives of it, as stored samples hold it.
//
// gives: light_NAME_arriving
// when: !raster
// cost: 0
fn light_NAME_found_share(light_NAME_found_arriving: f32) -> f32 {
    return light_NAME_found_arriving;
}

// The unit vector towards it; none where it stands on the surface.
//
// gives: light_NAME_toward
// domain: texel, fragment
// when: raster
// uses: vector
// cost: 10
fn light_NAME_direction(vertex_position: vec3f, light_NAME_position: vec3f) -> vec3f {
    return normalize_or(light_NAME_position - vertex_position, vec3f(0.0));
}

// What distance, range and cone leave of it.
//
// gives: light_NAME_reach
// domain: texel, fragment
// when: raster
// cost: 24
fn light_NAME_attenuation(
    vertex_position: vec3f,
    light_NAME_toward: vec3f,
    light_NAME_position: vec3f,
    light_NAME_axis: vec3f,
    light_NAME_cone: vec3f,
    light_NAME_range: f32,
) -> f32 {
    let way: vec3f = light_NAME_position - vertex_position;
    let square: f32 = dot(way, way);
    let share: f32 = square / max(light_NAME_range * light_NAME_range, 1e-20);
    let fade: f32 = select(1.0, max(1.0 - share * share, 0.0), light_NAME_range > 0.0);
    let along: f32 = -dot(light_NAME_axis, light_NAME_toward);
    let edge: f32 = clamp((along - light_NAME_cone.y) / max(light_NAME_cone.x - light_NAME_cone.y, 1e-3), 0.0, 1.0);
    return edge * edge * fade / max(square, 1e-8);
}

// What arrives of it, shadows as vertices have them.
//
// gives: light_NAME_arriving
// domain: texel, fragment
// when: raster, shadows, !shadow_maps
// cost: 1
fn light_NAME_unstopped(light_NAME_reach: f32, light_NAME_open: f32) -> f32 {
    return light_NAME_reach * light_NAME_open;
}

// What arrives of it, as shadow maps have it.
//
// gives: light_NAME_arriving
// domain: texel, fragment
// when: raster, shadows, shadow_maps
// cost: 1
fn light_NAME_mapped(light_NAME_reach: f32, light_NAME_seen: f32) -> f32 {
    return light_NAME_reach * light_NAME_seen;
}

// What arrives of it where nothing has a shadow.
//
// gives: light_NAME_arriving
// domain: texel, fragment
// when: raster, !shadows
// cost: 0
fn light_NAME_all(light_NAME_reach: f32) -> f32 {
    return light_NAME_reach;
}

// What arrives of it at the far side, as stored samples hold it.
//
// gives: light_NAME_beyond
// when: transmission, !raster
// cost: 0
fn light_NAME_found_far(light_NAME_found_beyond: f32) -> f32 {
    return light_NAME_found_beyond;
}

// What arrives of it at the far side, shadows as vertices have them.
//
// gives: light_NAME_beyond
// when: transmission, raster, shadows, !translucent_maps
// cost: 1
fn light_NAME_unstopped_beyond(light_NAME_reach: f32, light_NAME_far: f32) -> f32 {
    return light_NAME_reach * light_NAME_far;
}

// Where a shadow map tells how far that is, nothing stands before it.
//
// gives: light_NAME_beyond
// when: transmission, raster, shadows, translucent_maps
// cost: 0
fn light_NAME_mapped_beyond(light_NAME_reach: f32) -> f32 {
    return light_NAME_reach;
}

// What arrives of it at the far side where nothing has a shadow.
//
// gives: light_NAME_beyond
// when: transmission, raster, !shadows
// cost: 0
fn light_NAME_all_beyond(light_NAME_reach: f32) -> f32 {
    return light_NAME_reach;
}
