// The hilite attenuator a: neutral, as there is no map.
//
// gives: attenuator
// when: !has_attenuator_map, raster
// cost: 0
fn attenuator_neutral() -> f32 {
    return 1.0;
}
