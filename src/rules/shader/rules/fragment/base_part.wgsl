// What albedo and irradiance show from any angle (MODEL 3).
//
// gives: base_part
// shows: diffuse
// when: !layered
// cost: 6
fn base_light(diffuse_term: vec3f, occ: f32, base_weight: vec3f) -> vec3f {
    return diffuse_term * (occ * base_weight);
}
