// A colour to a power in [0, 1], a channel at a time: 0^0 = 1, and black stays black whatever the power (MODEL 6).
fn color_power(color: vec3f, power: f32) -> vec3f {
    let shown: vec3f = exp(power * log(max(color, vec3f(1e-30))));
    return select(shown, vec3f(select(0.0, 1.0, power <= 0.0)), color <= vec3f(0.0));
}
