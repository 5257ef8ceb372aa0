// rim_power along both: d rim / d p = z^p ln z, and 0 at z = 0; d rim / d z = p z^(p-1), taken at z = 1e-6
// below that, so that it stays finite for p < 1 (MODEL 7).
fn rim_power_tangent(silhouette: f32, rim_exponent: f32, d_silhouette: f32, d_exponent: f32) -> f32 {
    let positive: bool = silhouette >= 1.2e-38;
    let log2_z: f32 = log2(select(1.0, silhouette, positive));
    let power: f32 = exp2(rim_exponent * log2_z);
    let by_exponent: f32 = select(0.0, 0.6931472 * log2_z * power, positive);
    // A quotient takes less than a second power; log2(1e-6) = -19.93.
    let least: f32 = exp2((rim_exponent - 1.0) * -19.931568);
    let by_silhouette: f32 = rim_exponent * select(least, power / max(silhouette, 1e-6), silhouette >= 1e-6);
    return by_silhouette * d_silhouette + by_exponent * d_exponent;
}
