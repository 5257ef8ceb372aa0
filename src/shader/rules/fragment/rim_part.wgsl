// The diffuse light that is added towards the silhouette (MODEL 3).
//
// gives: rim_part
// cost: 10
fn rim_light(albedo: vec3f, irradiance: vec3f, occ: f32, rim: f32, rim_weight: vec3f) -> vec3f {
    return albedo * irradiance * (occ * rim * rim_weight);
}
