// S.z = 1 - |N.V| at the vertex (listing 3-3, SkinSilhouetteVec).
//
// gives: vertex_silhouette
// cost: 5
fn silhouette_at_vertex(vertex_normal: vec3f, vertex_view: vec3f) -> f32 {
    return 1.0 - min(abs(dot(vertex_normal, vertex_view)), 1.0);
}
