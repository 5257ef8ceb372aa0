// S.w clamped at 0 (MODEL 3, corrected form).
//
// gives: dapple
// when: corrected
// cost: 1
fn clamped_dapple(dapple_cosine: f32) -> f32 {
    return max(dapple_cosine, 0.0);
}
