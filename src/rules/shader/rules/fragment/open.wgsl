// S.x, the open share of the hemisphere, as interpolated.
//
// gives: open
// domain: texel, fragment
// when: raster
// cost: 0
fn open_share(vertex_occlusion: f32) -> f32 {
    return vertex_occlusion;
}
