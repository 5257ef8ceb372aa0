// What blooms (radiance times haze), blurred by a Gaussian along rows and then along columns, and added to the
// image; and what stands behind the mesh, which blooms too.
override largest: f32 = 65504.0;
// Whether the colour's alpha is the haze; else it is the coverage.
override hazy: bool = true;
// Whether what blooms was averaged over the samples of each pixel; else a pixel is one sample.
override averaged: bool = false;
// Whether something stands behind the mesh.
override opaque: bool = false;

// A factor on each channel of the image's radiance.
@group(0) @binding(0) var<uniform> gain: vec4f;
// Half of the Gaussian, from its middle outwards, in one row.
@group(0) @binding(1) var kernel: texture_2d<f32>;
// Radiance, and the haze or the coverage in alpha.
@group(0) @binding(2) var color: texture_2d<f32>;
@group(0) @binding(3) var coverage: texture_2d<f32>;
@group(0) @binding(4) var glow: texture_2d<f32>;
// Radiance behind the mesh, and what of it blooms; a single black texel where nothing stands there.
@group(0) @binding(5) var behind: texture_2d<f32>;
@group(0) @binding(6) var behind_glow: texture_2d<f32>;
@group(0) @binding(7) var across: texture_2d<f32>;

fn weight(k: i32) -> f32 {
    return textureLoad(kernel, vec2i(k, 0), 0).r;
}

fn color_at(at: vec2i) -> vec4f {
    return clamp(textureLoad(color, at, 0), vec4f(-largest), vec4f(largest));
}

fn coverage_at(at: vec2i) -> f32 {
    if (hazy) {
        return textureLoad(coverage, at, 0).r;
    }
    return textureLoad(color, at, 0).a;
}

// A pixel of a backdrop that may be a single black texel.
fn backdrop_at(backdrop: texture_2d<f32>, at: vec2i) -> vec3f {
    return textureLoad(backdrop, min(at, vec2i(textureDimensions(backdrop)) - 1), 0).rgb;
}

fn glow_at(at: vec2i) -> vec3f {
    let covered = coverage_at(at);
    var own = vec3f(0.0);
    if (averaged) {
        own = textureLoad(glow, at, 0).rgb;
    } else if (covered > 0.0) {
        // Both are premultiplied by the coverage, which counts once.
        let texel = color_at(at);
        own = texel.a / covered * texel.rgb;
    }
    return own + (1.0 - covered) * backdrop_at(behind_glow, at);
}

// Along rows; outside the image is black.
@fragment
fn bloom_across(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    let width = i32(textureDimensions(color).x);
    let radius = i32(textureDimensions(kernel).x) - 1;
    var sum = vec3f(0.0);
    for (var x = max(at.x - radius, 0); x <= min(at.x + radius, width - 1); x++) {
        sum += weight(abs(x - at.x)) * glow_at(vec2i(x, at.y));
    }
    return vec4f(clamp(gain.rgb * sum, vec3f(-largest), vec3f(largest)), 0.0);
}

// The image in front of what stands behind it.
fn image_at(at: vec2i) -> vec3f {
    let behind = (1.0 - coverage_at(at)) * backdrop_at(behind, at);
    return gain.rgb * (color_at(at).rgb + behind);
}

fn alpha_at(at: vec2i) -> f32 {
    return select(coverage_at(at), 1.0, opaque);
}

// Along columns, and added.
@fragment
fn bloom_down(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    let height = i32(textureDimensions(color).y);
    let radius = i32(textureDimensions(kernel).x) - 1;
    var sum = image_at(at);
    for (var y = max(at.y - radius, 0); y <= min(at.y + radius, height - 1); y++) {
        sum += weight(abs(y - at.y)) * textureLoad(across, vec2i(at.x, y), 0).rgb;
    }
    return vec4f(sum, alpha_at(at));
}

// The image without a bloom.
@fragment
fn in_front(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    return vec4f(image_at(at), alpha_at(at));
}
