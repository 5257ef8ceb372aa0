// exp(-d / l) a channel: what is left of light after d within the skin, l how far it comes before an e-th is left (Beer and
// Lambert; MODEL 11). From 80 lengths on value and slope are 0, so that no infinite d is multiplied by what it leaves; below 0,
// which multisampling extrapolates to beyond the edge of a triangle, nothing is in the way.
fn transmitted(depth: f32, reach: vec3f) -> vec3f {
    let d: vec3f = select(vec3f(0.0), vec3f(max(depth, 0.0)), vec3f(depth) < 80.0 * reach);
    return select(vec3f(0.0), exp(-d / reach), vec3f(depth) < 80.0 * reach);
}
