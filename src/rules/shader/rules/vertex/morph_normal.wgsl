// N = N0 + sum of w_i dN_i (listing 3-3).
//
// gives: morphed_normal
// when: morphs
// cost: 9 and 12 a morph
// uses: vector
// reads: morph_deltas, morph_weights
fn morph_normal(rest_normal: vec3f, vertex_index: u32) -> vec3f {
    let vertices = arrayLength(&morph_deltas) / (2u * MORPHS);
    var normal = rest_normal;
    for (var i = 0u; i < MORPHS; i++) {
        normal += constants.morph_weights[i].x * morph_deltas[2u * (i * vertices + vertex_index) + 1u].xyz;
    }
    return normalize_or(normal, vec3f(0.0, 0.0, 1.0));
}
