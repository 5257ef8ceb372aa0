// diffuse base_weight: without the rim, what is seen from any angle is all (MODEL 3).
//
// gives: diffuse_part
// when: !rim
// cost: 9
fn diffuse_light_without_rim(albedo: vec3f, irradiance: vec3f, occ: f32, base_weight: vec3f) -> vec3f {
    return albedo * irradiance * (occ * base_weight);
}
