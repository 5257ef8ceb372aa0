// exp(-d / l): what is left of light after d within the skin, l how far it comes before an e-th is left (Beer and Lambert;
// MODEL 11). From 80 lengths on value and slope are 0, so that no infinite d is multiplied by what it leaves; below 0, which
// multisampling extrapolates to beyond the edge of a triangle, nothing is in the way.
fn channel_transmitted(depth: f32, reach: f32) -> f32 {
    let near: bool = depth < 80.0 * reach;
    let d: f32 = select(0.0, max(depth, 0.0), near);
    return select(0.0, exp(-d / reach), near);
}

// The same a channel.
fn transmitted(depth: f32, reach: vec3f) -> vec3f {
    return vec3f(
        channel_transmitted(depth, reach.x),
        channel_transmitted(depth, reach.y),
        channel_transmitted(depth, reach.z),
    );
}
