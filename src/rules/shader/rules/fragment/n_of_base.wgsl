// Without a normal map n is a stored sample's base.
//
// gives: n
// fallback: normal
// when: !bumped, corrected, !raster
// cost: 22
// uses: vector
fn n_of_base(base: vec3f, normal: vec3f, view: vec3f) -> vec3f {
    return normalize_or(base, normalize_or(normal, -view));
}
