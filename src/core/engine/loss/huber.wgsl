// Squared up to HUBER_THRESHOLD, linear beyond it, as a reweighted square.
fn weighted_residual(shown: f32, observed: f32, weight: f32) -> vec3f {
    let r = shown - observed;
    let size = abs(r);
    let inside = HUBER_THRESHOLD >= size;
    let reweight = select(HUBER_THRESHOLD / max(size, HUBER_THRESHOLD), 1.0, inside);
    let beyond = HUBER_THRESHOLD * (size + size - HUBER_THRESHOLD);
    let scale = sqrt(weight * reweight);
    return vec3f(weight * select(beyond, r * r, inside), scale, scale * r);
}
