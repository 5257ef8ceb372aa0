// One fetch of a level whose empty texels were filled: bilinear among four texels, whatever they are of, clamped at the atlas'
// edge (MODEL 6).
fn {level}_at(uv: vec2f) -> vec4f {
    let most: f32 = f32({size} - 1);
    let whole: vec2f = uv * f32({size}) - vec2f(0.5, 0.5);
    let at: vec2f = vec2f(min(max(whole.x, 0.0), most), min(max(whole.y, 0.0), most));
    let f: vec2f = at - floor(at);
    let low: vec2i = vec2i(floor(at));
    let high: vec2i = vec2i(min(low.x + 1, {size} - 1), min(low.y + 1, {size} - 1));
    let above: vec4f = mix({level}_near(low), {level}_near(vec2i(high.x, low.y)), f.x);
    let below: vec4f = mix({level}_near(vec2i(low.x, high.y)), {level}_near(high), f.x);
    return mix(above, below, f.y);
}
