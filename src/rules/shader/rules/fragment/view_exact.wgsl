// V, from the eye to the surface, re-normalised (MODEL 3, corrected form).
//
// gives: view
// when: corrected, raster
// cost: 12
// uses: vector
fn view_exact(vertex_position: vec3f, eye: vec3f) -> vec3f {
    return normalize_or(vertex_position - eye, vec3f(0.0, 0.0, -1.0));
}
