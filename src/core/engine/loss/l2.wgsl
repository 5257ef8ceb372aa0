// The squared residual.
fn weighted_residual(shown: f32, observed: f32, weight: f32) -> vec3f {
    let scale = sqrt(weight);
    let residual = scale * (shown - observed);
    return vec3f(residual * residual, scale, residual);
}
