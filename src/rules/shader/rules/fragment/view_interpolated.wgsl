// V as interpolated (listing 3-4).
//
// gives: view
// when: listing, raster
// cost: 0
fn view_interpolated(vertex_view: vec3f) -> vec3f {
    return vertex_view;
}
