// gives: n
// when: !bumped, listing, !raster
// cost: 0
fn n_of_base_as_listed(base: vec3f) -> vec3f {
    return base;
}
