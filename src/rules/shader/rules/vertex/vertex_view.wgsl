// V, from the eye to the surface (listing 3-3, WorldEyeDir); an eye on the vertex sees along -Z.
//
// gives: vertex_view
// cost: 12
// uses: vector
fn view_at_vertex(vertex_position: vec3f, eye: vec3f) -> vec3f {
    return normalize_or(vertex_position - eye, vec3f(0.0, 0.0, -1.0));
}
