// The side-specular intensity s: neutral, as there is no map.
//
// gives: specular
// domain: texel, fragment
// when: !has_specular_map, raster
// cost: 0
fn specular_neutral() -> f32 {
    return 1.0;
}
