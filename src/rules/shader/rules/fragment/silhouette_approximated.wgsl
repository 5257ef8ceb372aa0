// S.z interpolated from the vertices where the scene asks for it at the fragment: as far off as the mesh is
// coarse.
//
// gives: silhouette
// when: fragment_silhouette, raster
// cost: 0
// error: tessellation
// paper: yes
fn silhouette_approximated(vertex_silhouette: f32) -> f32 {
    return vertex_silhouette;
}
