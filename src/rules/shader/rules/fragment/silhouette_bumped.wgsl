// S.z = 1 - |n.V| from the bumped normal, so that pores catch the rim (MODEL 2).
//
// gives: silhouette
// when: bumped_silhouette
// cost: 5
fn silhouette_bumped(n: vec3f, view: vec3f) -> f32 {
    return 1.0 - min(abs(dot(n, view)), 1.0);
}
