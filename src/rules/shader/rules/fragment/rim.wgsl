// rim = S.z ^ rim_exponent (MODEL 3).
//
// gives: rim
// when: !square_rim, !interpolated_rim
// cost: 10
// uses: rim
fn rim_of_silhouette(silhouette: f32, rim_exponent: f32) -> f32 {
    return rim_power(silhouette, rim_exponent);
}
