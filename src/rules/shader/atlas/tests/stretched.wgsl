// effect: NAME, light under a stretched skin
// parameter: NAME_radius = 0.05 in [0.001, 30]; standard deviation, in the scene's unit; a test
// parameter: NAME_depth = 1.5 in [0.1, 10]; exponent of the light map; a test
//
// gives: NAME_light
// domain: texel
// cost: 12
fn NAME_map(vertex_uv: vec2f, NAME_depth: f32) -> vec3f {
    let power: f32 = exp(NAME_depth * log(0.1 + vertex_uv.x));
    return vec3f(power, power * vertex_uv.y, vertex_uv.y * vertex_uv.y);
}

// gives: NAME_stretch
// domain: texel
// cost: 20
fn NAME_stretch_map(vertex_position: vec3f) -> vec2f {
    let along: vec3f = dpdx(vertex_position);
    let down: vec3f = dpdy(vertex_position);
    return sqrt(vec2f(dot(along, along), dot(down, down)));
}

// gives: NAME_soft
// domain: texel
// pass: NAME_light: vec3f, 5 taps
// sampled: 0
// cost: 8
fn NAME_kernel(tap: f32, axis: vec2f, NAME_radius: f32, NAME_stretch: vec2f) -> vec2f {
    let step: f32 = dot(NAME_stretch, axis);
    return vec2f(tap * NAME_radius / max(step, 1e-6), exp(-0.5 * tap * tap));
}
