// Albedo, linear Rec.709: neutral, as there is no map.
//
// gives: albedo
// domain: texel, fragment
// when: !has_color_map, raster
// cost: 0
fn albedo_neutral() -> vec3f {
    return vec3f(1.0);
}
