// Stored samples hold N only for the key light; elsewhere it but stands in for a normal without a direction.
//
// gives: normal
// when: !raster, !key_light
// cost: 0
fn normal_of_base(base: vec3f) -> vec3f {
    return base;
}
