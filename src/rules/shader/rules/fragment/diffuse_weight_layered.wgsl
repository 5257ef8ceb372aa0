// base_weight + rim_weight rim, of what enters (MODEL 12).
//
// gives: diffuse_weight
// when: rim, layered
// cost: 9
fn weighed_by_rim_layered(rim: f32, entering: vec3f, base_weight: vec3f, rim_weight: vec3f) -> vec3f {
    return entering * (base_weight + rim * rim_weight);
}
