
// E_l / pi before its colour: what the light NAME brings to the bumped normal, once for a white surface.
//
// gives: light_NAME_facing
// domain: texel, fragment
// cost: 8
fn light_NAME_cosine(n: vec3f, light_NAME_toward: vec3f, light_NAME_arriving: f32) -> f32 {
    return 0.3183098861837907 * (max(dot(n, light_NAME_toward), 0.0) * light_NAME_arriving);
}

// albedo E_l / pi, before its colour and the diffuse weights.
//
// gives: light_NAME_term
// when: lights
// cost: 6
fn light_NAME_diffuse(albedo: vec3f, light_NAME_facing: f32, light_NAME_irradiance: vec3f) -> vec3f {
    return albedo * (light_NAME_facing * light_NAME_irradiance);
}

// What the light NAME shows of the skin (MODEL 12).
//
// gives: light_NAME_part
// adds: light_NAME
// when: lights
// cost: 6
fn light_NAME_shown(light_NAME_term: vec3f, diffuse_weight: vec3f, light_NAME_color: vec3f) -> vec3f {
    return light_NAME_color * diffuse_weight * light_NAME_term;
}
