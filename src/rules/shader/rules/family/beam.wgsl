// Light from one direction, beside the environment (MODEL 8; glTF's KHR_lights_punctual).
//
// effect: light_NAME within lights, the light NAME
// parameter: light.NAME.color = 1 in [0, inf), rgb, linear, scene, weighs light_NAME; factor on the light's irradiance; KHR_lights_punctual
// parameter: light.NAME.irradiance = 0 in [0, inf), rgb, held; irradiance of a surface that faces it; KHR_lights_punctual
// parameter: light.NAME.azimuth = 0 in [-inf, inf], unit degrees, found; where it comes from, from +Z towards +X; KHR_lights_punctual
// parameter: light.NAME.elevation = 45 in [-90, 90], unit degrees, found; where it comes from, above the horizon; KHR_lights_punctual
// parameter: light.NAME.shadow_map = -1 in [-1, inf], held; first layer of its shadow map, -1 where it has none; Williams 1978
// sample_field: light_NAME_open: f32 = 1; share of the light NAME that nothing stops
// sample_field: light_NAME_depth: f32 = 4000; millimetres to the surface that faces the light NAME
// sample_field: light_NAME_far: f32 = 1; share of the light NAME that arrives at that surface
// sample_field: light_NAME_far_light: vec3f = 0; what arrives of the light NAME where rays inward leave, weakened on the way
// sample_field: light_NAME_far_light_0: vec3f = 0; what arrives of the light NAME where rays inward leave after 0, 0.1 and 0.2 mm
// sample_field: light_NAME_far_light_1: vec3f = 0; what arrives of the light NAME where rays inward leave after 0.4, 0.8 and 1.5 mm
// sample_field: light_NAME_far_light_2: vec3f = 0; what arrives of the light NAME where rays inward leave after 3, 5.5 and 10 mm
// sample_field: light_NAME_far_light_3: vec3f = 0; what arrives of the light NAME where rays inward leave after 18, 32 and 50 mm

// Unit vector towards the light.
//
// gives: light_NAME_bearing
// domain: texel, fragment
// cost: 20
fn light_NAME_direction(light_NAME_azimuth: f32, light_NAME_elevation: f32) -> vec3f {
    let azimuth: f32 = 0.017453292519943295 * light_NAME_azimuth;
    let elevation: f32 = 0.017453292519943295 * light_NAME_elevation;
    return vec3f(cos(elevation) * sin(azimuth), sin(elevation), cos(elevation) * cos(azimuth));
}

// What arrives of it, as share of a facing surface's irradiance: all that nothing stops.
//
// gives: light_NAME_arriving
// domain: texel, fragment
// when: shadows, !shadow_maps
// cost: 0
fn light_NAME_unstopped(light_NAME_open: f32) -> f32 {
    return light_NAME_open;
}

// What arrives of it, as shadow maps have it.
//
// gives: light_NAME_arriving
// domain: texel, fragment
// when: raster, shadows, shadow_maps
// cost: 0
fn light_NAME_mapped(light_NAME_seen: f32) -> f32 {
    return light_NAME_seen;
}

// What arrives of it where nothing has a shadow.
//
// gives: light_NAME_arriving
// domain: texel, fragment
// when: !shadows
// cost: 0
fn light_NAME_all() -> f32 {
    return 1.0;
}

// What arrives of it at the far side.
//
// gives: light_NAME_beyond
// when: transmission, shadows, !translucent_maps
// cost: 0
fn light_NAME_unstopped_beyond(light_NAME_far: f32) -> f32 {
    return light_NAME_far;
}

// Where a shadow map tells how far that is, nothing stands before it.
//
// gives: light_NAME_beyond
// when: transmission, shadows, translucent_maps
// cost: 0
fn light_NAME_mapped_beyond() -> f32 {
    return 1.0;
}

// What arrives of it at the far side where nothing has a shadow.
//
// gives: light_NAME_beyond
// when: transmission, !shadows
// cost: 0
fn light_NAME_all_beyond() -> f32 {
    return 1.0;
}
