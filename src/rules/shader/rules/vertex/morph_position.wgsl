// Morph targets (listing 3-3): x = x0 + sum of w_i dx_i.
//
// gives: morphed_position
// when: morphs
// cost: 12 a morph
// reads: morph_deltas, morph_weights
fn morph_position(rest_position: vec3f, vertex_index: u32) -> vec3f {
    let vertices = arrayLength(&morph_deltas) / (2u * MORPHS);
    var position = rest_position;
    for (var i = 0u; i < MORPHS; i++) {
        position += constants.morph_weights[i].x * morph_deltas[2u * (i * vertices + vertex_index)].xyz;
    }
    return position;
}
