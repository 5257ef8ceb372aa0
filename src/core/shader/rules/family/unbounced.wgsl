
// albedo E_l / pi, before its colour and the diffuse weights.
//
// gives: light_NAME_term
// when: lights
// cost: 6
fn light_NAME_diffuse(albedo: vec3f, light_NAME_facing: f32, light_NAME_irradiance: vec3f) -> vec3f {
    return albedo * (light_NAME_facing * light_NAME_irradiance);
}
