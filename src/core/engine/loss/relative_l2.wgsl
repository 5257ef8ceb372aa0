// The squared residual relative to the target: (m - t)^2 / (t^2 + RELATIVE_FLOOR).
fn weighted_residual(shown: f32, observed: f32, weight: f32) -> vec3f {
    let scale = sqrt(weight / (observed * observed + RELATIVE_FLOOR));
    let residual = scale * (shown - observed);
    return vec3f(residual * residual, scale, residual);
}
