// The bilinear value of one level of a map at texture coordinates; the map repeats in both directions.
fn sample_mip_level(texels: texture_2d<f32>, uv: vec2f, level: i32) -> vec4f {
    // As an adapter halves them. (Asked for a level's, llvmpipe tells all lanes those of the first one's level, also where
    // that lane has nothing to shade.)
    let size = max(vec2i(textureDimensions(texels)) >> vec2u(u32(level)), vec2i(1));
    let at = fract(uv) * vec2f(size) - 0.5;
    let low = floor(at);
    let f = at - low;
    let i = (vec2i(low) + size) % size;
    let j = (i + 1) % size;
    let a = textureLoad(texels, i, level);
    let b = textureLoad(texels, vec2i(j.x, i.y), level);
    let c = textureLoad(texels, vec2i(i.x, j.y), level);
    let d = textureLoad(texels, j, level);
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}

// A map's mean over a fragment whose texture coordinates go `steps` to its neighbours (right in xy, below in zw): at up to
// `most` places along the longer of the two, between the levels whose texels are as large as what one place stands for
// (Vulkan 1.3, Image Operations: "Scale Factor Operation", "LOD Operation", "Texel Anisotropic Filtering").
fn sample_mip_texels(texels: texture_2d<f32>, uv: vec2f, steps: vec4f, most: f32) -> vec4f {
    let size = vec2f(textureDimensions(texels));
    // Of more repeats than that nothing but the mean is left.
    let bounded = clamp(steps, vec4f(-65536.0), vec4f(65536.0));
    let right = length(bounded.xy * size);
    let below = length(bounded.zw * size);
    let longer = max(right, below);
    let along = select(bounded.zw, bounded.xy, right > below);
    let share = max(min(right, below), longer / most);
    let taps = select(1.0, min(ceil(longer / share), most), longer > 1.0);
    let levels = textureNumLevels(texels);
    let at = min(log2(max(share, 1.0)), f32(levels - 1u));
    var sum = vec4f(0.0);
    // Level by level and without a way out before: llvmpipe loads from one level for four neighbouring fragments, whichever
    // each of them names.
    for (var level = 0u; level < levels; level++) {
        let weight = 1.0 - abs(f32(level) - at);
        if (weight > 0.0) {
            for (var tap = 1.0; tap <= taps; tap += 1.0) {
                let place = uv + (tap / (taps + 1.0) - 0.5) * along;
                sum += weight * sample_mip_level(texels, place, i32(level));
            }
        }
    }
    return sum / taps;
}
