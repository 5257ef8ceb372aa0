// The value of a level at texture coordinates, bilinearly of those of its four texels that hold something (w > 0); 0
// where none does (MODEL 6).
fn sample_level(level: texture_2d<f32>, uv: vec2f) -> vec4f {
    let size = vec2i(textureDimensions(level));
    let at = uv * vec2f(size) - 0.5;
    let low = floor(at);
    let f = at - low;
    var sum = vec4f(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let step = vec2i(corner & 1, corner >> 1u);
        let place = vec2i(low) + step;
        let inside = all(place >= vec2i(0)) && all(place < size);
        let texel = textureLoad(level, clamp(place, vec2i(0), size - 1), 0);
        let share = select(1.0 - f, f, step == vec2i(1));
        sum += select(0.0, share.x * share.y, inside && texel.w > 0.0) * vec4f(texel.xyz, 1.0);
    }
    return sum / select(1.0, sum.w, sum.w > 0.0);
}
