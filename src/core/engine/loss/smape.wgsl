// |m - t| / (|m| + |t| + SMAPE_FLOOR), rounded off below SMAPE_CORNER, as a reweighted square.
fn weighted_residual(shown: f32, observed: f32, weight: f32) -> vec3f {
    let r = shown - observed;
    let size = abs(r);
    let inverse = 1.0 / (abs(shown) + abs(observed) + SMAPE_FLOOR);
    let rounded = select(size, 0.5 * (r * r / SMAPE_CORNER + SMAPE_CORNER), SMAPE_CORNER >= size);
    let value = rounded * inverse;
    let reweight = 0.5 * inverse / max(size, SMAPE_CORNER);
    let scale = sqrt(weight * reweight);
    // d/dm (|r| / D) = sign(r) / D - |r| sign(m) / D^2, as a multiple of the reweight. Where both have a sign,
    // 1 - |r| / D is written as what is left of D, for a bright model would cancel in it.
    let sign_of = select(-1.0, 1.0, shown >= 0.0);
    let one_side = select(0.0, min(abs(shown), abs(observed)), shown * observed >= 0.0);
    let left = (2.0 * one_side + SMAPE_FLOOR) * inverse;
    let beyond = r * select(1.0 + size * inverse, left, sign_of * r >= 0.0);
    let slope = select(beyond, r - sign_of * value * SMAPE_CORNER, SMAPE_CORNER >= size);
    return vec3f(weight * value, scale, scale * slope);
}
