// rim = S.y, as interpolated from the vertices (listing 3-3).
//
// gives: rim
// when: interpolated_rim, raster
// cost: 0
fn rim_as_interpolated(vertex_rim: f32) -> f32 {
    return vertex_rim;
}
