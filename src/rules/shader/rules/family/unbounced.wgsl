
// albedo E_l / pi, before its colour and the diffuse weights.
//
// gives: light_NAME_term
// when: lights
// cost: 6
fn light_NAME_diffuse(albedo: vec3f, light_NAME_facing: f32, light_NAME_irradiance: vec3f) -> vec3f {
    return albedo * (light_NAME_facing * light_NAME_irradiance);
}

// E_l / pi in its colour, for the sum of all light.
//
// gives: light_NAME_lit
// domain: texel, fragment
// joins: diffusion_lit
// when: lights, diffusion
// cost: 6
fn light_NAME_in_light_map(
    light_NAME_facing: f32,
    light_NAME_irradiance: vec3f,
    light_NAME_color: vec3f,
) -> vec3f {
    return light_NAME_color * (light_NAME_facing * light_NAME_irradiance);
}
