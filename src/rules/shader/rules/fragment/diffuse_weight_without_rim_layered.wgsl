// Without a rim all diffuse light counts as the base, of what enters (MODEL 12).
//
// gives: diffuse_weight
// when: !rim, layered
// cost: 3
fn weighed_alike_layered(entering: vec3f, base_weight: vec3f) -> vec3f {
    return entering * base_weight;
}
