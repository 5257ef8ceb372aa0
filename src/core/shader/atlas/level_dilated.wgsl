// One fetch of a level whose empty texels were filled: bilinear among four texels, whatever they are of, clamped at the atlas'
// edge (MODEL 6).
fn level_at(level: texture_2d<f32>, uv: vec2f) -> vec4f {
    let most = vec2i(textureDimensions(level)) - 1;
    let at = clamp(uv * vec2f(most + 1) - 0.5, vec2f(0.0), vec2f(most));
    let low = vec2i(floor(at));
    let high = min(low + 1, most);
    let f = at - floor(at);
    let above = mix(textureLoad(level, low, 0), textureLoad(level, vec2i(high.x, low.y), 0), f.x);
    let below = mix(textureLoad(level, vec2i(low.x, high.y), 0), textureLoad(level, high, 0), f.x);
    return mix(above, below, f.y);
}
