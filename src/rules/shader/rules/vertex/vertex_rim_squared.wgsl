// S.y = S.z^2 at the vertex (listing 3-3).
//
// gives: vertex_rim
// when: square_rim
// cost: 1
fn squared_rim_at_vertex(vertex_silhouette: f32) -> f32 {
    return vertex_silhouette * vertex_silhouette;
}
