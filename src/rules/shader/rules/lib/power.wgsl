// A number in [0, 1] to such a power: 0^0 = 1, and 0 stays 0 whatever the power (MODEL 6).
fn channel_power(x: f32, power: f32) -> f32 {
    return select(exp(power * log(max(x, 1e-30))), select(0.0, 1.0, power <= 0.0), x <= 0.0);
}

// A colour, a channel at a time.
fn color_power(color: vec3f, power: f32) -> vec3f {
    return vec3f(channel_power(color.x, power), channel_power(color.y, power), channel_power(color.z, power));
}
