// S.w, signed (listing 3-3).
//
// gives: dapple
// when: listing
// cost: 0
fn signed_dapple(dapple_cosine: f32) -> f32 {
    return dapple_cosine;
}
