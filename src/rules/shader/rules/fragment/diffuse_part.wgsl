// diffuse (base_weight + rim_weight rim) (MODEL 3).
//
// gives: diffuse_part
// adds: diffuse, rim
// when: rim, !layered
// cost: 9
fn diffuse_light(diffuse_term: vec3f, occ: f32, rim: f32, base_weight: vec3f, rim_weight: vec3f) -> vec3f {
    return diffuse_term * (occ * (base_weight + rim * rim_weight));
}
