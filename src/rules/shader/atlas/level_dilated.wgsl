// One fetch of a level whose empty texels were filled: bilinear among four texels, whatever they are of, clamped at the atlas'
// edge (MODEL 6).
fn level_at(level: Level, uv: vec2f) -> vec4f {
    let most = level_size(level) - 1;
    let at = clamp(uv * vec2f(most + 1) - 0.5, vec2f(0.0), vec2f(most));
    let low = vec2i(floor(at));
    let high = min(low + 1, most);
    let f = at - floor(at);
    let above = mix(level_texel(level, low), level_texel(level, vec2i(high.x, low.y)), f.x);
    let below = mix(level_texel(level, vec2i(low.x, high.y)), level_texel(level, high), f.x);
    return mix(above, below, f.y);
}
