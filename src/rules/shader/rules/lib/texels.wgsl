// The bilinear value of a map's finest level at texture coordinates; the map repeats in both directions.
fn sample_texels(texels: texture_2d<f32>, uv: vec2f) -> vec4f {
    let size = vec2i(textureDimensions(texels));
    let at = fract(uv) * vec2f(size) - 0.5;
    let low = floor(at);
    let f = at - low;
    let i = (vec2i(low) + size) % size;
    let j = (i + 1) % size;
    let a = textureLoad(texels, i, 0);
    let b = textureLoad(texels, vec2i(j.x, i.y), 0);
    let c = textureLoad(texels, vec2i(i.x, j.y), 0);
    let d = textureLoad(texels, j, 0);
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}
