// Without a rim all diffuse light counts as the base.
//
// gives: diffuse_weight
// when: !rim, !layered
// cost: 0
fn weighed_alike(base_weight: vec3f) -> vec3f {
    return base_weight;
}
