// S.z of this corner, in its own place, so that S.z of each of them can be told where all three are interpolated.
//
// gives: vertex_silhouettes
// cost: 3
fn silhouette_at_corner(corner: vec3f, vertex_silhouette: f32) -> vec3f {
    return corner * vertex_silhouette;
}
