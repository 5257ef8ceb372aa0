// effect: NAME, light that wanders under the surface
// parameter: NAME_weight = 0.5 in [0, inf), rgb, linear; weight of what wandered; a test
// parameter: NAME_radius = 1.3 in [0.1, 30], unit texels; how far it wandered; a test
//
// The light map: hills over the atlas.
//
// gives: NAME_light
// domain: texel
// cost: 12
fn NAME_light_map(vertex_uv: vec2f) -> vec3f {
    let within: vec2f = fract(HILLS * vertex_uv);
    return vec3f(4.0 * within * (1.0 - within), vertex_uv.x * vertex_uv.y);
}

// A Gaussian of seven taps, a standard deviation apart.
//
// gives: NAME_soft
// domain: texel
// pass: NAME_light: vec3f, 7 taps
// sampled: 0
// cost: 8
fn NAME_kernel(tap: f32, NAME_radius: f32) -> vec2f {
    return vec2f(NAME_radius * tap, exp(-0.5 * tap * tap));
}
