// S.z as interpolated from the vertices (listing 3-3): cheap, and wrong inside large triangles.
//
// gives: silhouette
// when: vertex_silhouette, raster
// cost: 0
fn silhouette_interpolated(vertex_silhouette: f32) -> f32 {
    return vertex_silhouette;
}
