// The normal map's texel, in [0, 1]: neutral, as there is no map.
//
// gives: normal_texel
// domain: texel, fragment
// when: !has_normal_map, raster
// cost: 0
fn normal_texel_neutral() -> vec3f {
    return vec3f(0.5, 0.5, 1.0);
}
