// diffuse base_weight: without the rim, what is seen from any angle is all (MODEL 3).
//
// gives: diffuse_part
// adds: diffuse, rim
// when: !rim, !layered
// cost: 6
fn diffuse_light_without_rim(diffuse_term: vec3f, occ: f32, base_weight: vec3f) -> vec3f {
    return diffuse_term * (occ * base_weight);
}
