// base_weight + rim_weight rim: what weighs the diffuse light of lamps (MODEL 12).
//
// gives: diffuse_weight
// when: rim, !layered
// cost: 6
fn weighed_by_rim(rim: f32, base_weight: vec3f, rim_weight: vec3f) -> vec3f {
    return base_weight + rim * rim_weight;
}
