// S.y = S.z ^ rim_exponent at the vertex: the listing's square (3-3) with an exponent that may be another.
//
// gives: vertex_rim
// when: !square_rim
// cost: 10
// uses: rim
fn rim_at_vertex(vertex_silhouette: f32, rim_exponent: f32) -> f32 {
    return rim_power(vertex_silhouette, rim_exponent);
}
