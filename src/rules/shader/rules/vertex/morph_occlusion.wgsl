// The occlusion rides with the morph targets (listing 3-3); not clamped, as listed.
//
// gives: vertex_occlusion
// when: morphs
// cost: 4 a morph
// reads: morph_deltas, morph_weights
fn morph_occlusion(rest_occlusion: f32, vertex_index: u32) -> f32 {
    let vertices = arrayLength(&morph_deltas) / (2u * MORPHS);
    var occlusion = rest_occlusion;
    for (var i = 0u; i < MORPHS; i++) {
        occlusion += constants.morph_weights[i].x * morph_deltas[2u * (i * vertices + vertex_index)].w;
    }
    return occlusion;
}
