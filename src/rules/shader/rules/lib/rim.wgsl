// S.z to a power, with 0^p = 0 and 0^0 = 1 (MODEL 3 and 7).
fn rim_power(silhouette: f32, rim_exponent: f32) -> f32 {
    // The smallest positive normal f32; below it the power is 0 for any exponent of the table's bounds.
    let positive: bool = silhouette >= 1.2e-38;
    let power: f32 = exp2(rim_exponent * log2(select(1.0, silhouette, positive)));
    return select(select(1.0, 0.0, rim_exponent > 0.0), power, positive);
}
