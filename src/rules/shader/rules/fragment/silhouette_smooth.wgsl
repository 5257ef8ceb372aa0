// S.z = 1 - |N.V| from the smooth normal at the fragment (MODEL 2).
//
// gives: silhouette
// when: fragment_silhouette, raster
// cost: 5
fn silhouette_smooth(normal: vec3f, view: vec3f) -> f32 {
    return 1.0 - min(abs(dot(normal, view)), 1.0);
}
