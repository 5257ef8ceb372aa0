// The diffuse light: albedo E_d(n), before occlusion and weights (MODEL 3).
//
// gives: diffuse_term
// domain: texel, fragment
// cost: 3
fn albedo_times_irradiance(albedo: vec3f, irradiance: vec3f) -> vec3f {
    return albedo * irradiance;
}
