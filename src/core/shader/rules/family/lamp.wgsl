// Light of a lamp that stands somewhere, a point or a spot (MODEL 8; glTF's KHR_lights_punctual).
//
// effect: light_NAME within lights, the light NAME
// parameter: light.NAME.color = 1 in [0, inf), rgb, linear, scene; factor on the light's intensity; KHR_lights_punctual
// parameter: light.NAME.irradiance = 0 in [0, inf), rgb, held; irradiance of a facing surface at distance 1; KHR_lights_punctual
// sample_field: light_NAME_toward: vec3f = 0; unit vector towards the light NAME
// sample_field: light_NAME_arriving: f32 = 0; what distance, cone and shadow leave of the light NAME
