// What albedo and irradiance show from any angle (MODEL 3).
//
// gives: base_part
// cost: 9
fn base_light(albedo: vec3f, irradiance: vec3f, occ: f32, base_weight: vec3f) -> vec3f {
    return albedo * irradiance * (occ * base_weight);
}
