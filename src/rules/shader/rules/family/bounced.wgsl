// sample_field: light_NAME_bounced: vec3f = 0; what the skin throws back of the light NAME, over pi, of a strength of 1

// albedo times what comes of the light NAME straight, and by way of the skin, before its colour and the diffuse weights.
//
// gives: light_NAME_term
// when: lights, lights_bounce
// cost: 9
fn light_NAME_diffuse_and_bounced(
    albedo: vec3f,
    light_NAME_facing: f32,
    light_NAME_bounced: vec3f,
    light_NAME_irradiance: vec3f,
) -> vec3f {
    return albedo * ((vec3f(light_NAME_facing) + light_NAME_bounced) * light_NAME_irradiance);
}

// albedo E_l / pi, before its colour and the diffuse weights.
//
// gives: light_NAME_term
// when: lights, !lights_bounce
// cost: 6
fn light_NAME_diffuse(albedo: vec3f, light_NAME_facing: f32, light_NAME_irradiance: vec3f) -> vec3f {
    return albedo * (light_NAME_facing * light_NAME_irradiance);
}

// E_l / pi with what the skin throws back of it, in its colour, for the sum of all light.
//
// gives: light_NAME_lit
// domain: texel, fragment
// joins: diffusion_lit
// when: lights, diffusion, lights_bounce
// cost: 9
fn light_NAME_in_light_map_and_bounced(
    light_NAME_facing: f32,
    light_NAME_bounced: vec3f,
    light_NAME_irradiance: vec3f,
    light_NAME_color: vec3f,
) -> vec3f {
    return light_NAME_color * ((vec3f(light_NAME_facing) + light_NAME_bounced) * light_NAME_irradiance);
}

// E_l / pi in its colour, for the sum of all light.
//
// gives: light_NAME_lit
// domain: texel, fragment
// joins: diffusion_lit
// when: lights, diffusion, !lights_bounce
// cost: 6
fn light_NAME_in_light_map(
    light_NAME_facing: f32,
    light_NAME_irradiance: vec3f,
    light_NAME_color: vec3f,
) -> vec3f {
    return light_NAME_color * (light_NAME_facing * light_NAME_irradiance);
}
