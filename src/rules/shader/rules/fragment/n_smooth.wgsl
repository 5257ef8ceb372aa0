// Without a normal map n is the smooth normal.
//
// gives: n
// domain: texel, fragment
// when: !bumped, corrected, raster
// cost: 0
fn n_smooth(normal: vec3f) -> vec3f {
    return normal;
}
