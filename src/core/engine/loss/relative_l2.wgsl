// max(x, 0), of NaN NaN.
fn lit_part(x: f32) -> f32 {
    return select(x, 0.0, x < 0.0);
}

// 2 int_t^m (x - t) / (max(x, 0) + RELATIVE_FLOOR)^2 dx: near m = t the square relative to the model's own value, and a
// loss whose slope is that of this square with its denominator held. Why: `Residuals` in residual.rs.
fn relative_deviance(shown: f32, observed: f32) -> f32 {
    let a = lit_part(shown);
    let b = lit_part(observed);
    let dark_shown = min(shown, 0.0);
    let dark_observed = min(observed, 0.0);
    let p = a + RELATIVE_FLOOR;
    let q = b + RELATIVE_FLOOR;
    let of_model = (a - b) / p;
    // Halves, so that the sum of huge numbers is finite.
    let share = 0.5 * (a - b) / (0.5 * p + 0.5 * q);
    let square = share * share;
    // artanh(share) - share, by its series where the logarithm would cancel.
    let high = 0.1111111111 + square * (0.0909090909 + square * (0.0769230769 + square * 0.0666666667));
    let series = 0.3333333333 + square * (0.2 + square * (0.1428571429 + square * high));
    // ln 2 as the library knows it, to all digits of any number.
    let by_log = 0.5 * (0.6931472 * log2(p / q)) - share;
    let beyond = select(by_log, series * square * share, abs(share) <= RELATIVE_SMALL_SHARE);
    let bright = 2.0 * (share * of_model + 2.0 * beyond) - 2.0 * dark_observed * of_model / q;
    let inverse = 1.0 / RELATIVE_FLOOR;
    // In this order no digit is lost where both are dark.
    let slopes = (dark_shown - observed) + (dark_observed - observed);
    let below = (dark_shown - dark_observed) * inverse * (slopes * inverse);
    return bright + below;
}

// The squared residual relative to the model's value, held, with the loss that has its slope.
fn weighted_residual(shown: f32, observed: f32, weight: f32) -> vec3f {
    let scale = sqrt(weight) / (lit_part(shown) + RELATIVE_FLOOR);
    return vec3f(weight * relative_deviance(shown, observed), scale, scale * (shown - observed));
}
