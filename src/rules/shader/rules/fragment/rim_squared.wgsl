// rim = S.z^2, where the exponent is the listing's.
//
// gives: rim
// when: square_rim, !interpolated_rim
// cost: 1
fn rim_squared(silhouette: f32) -> f32 {
    return silhouette * silhouette;
}
