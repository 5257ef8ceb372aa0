// Haze-weighted colour, blurred by a Gaussian along rows and then along columns, and added to the image.
override largest: f32 = 65504.0;

// A factor on the image's radiance and haze, in x.
@group(0) @binding(0) var<uniform> gain: vec4f;
// Half of the Gaussian, from its middle outwards, in one row.
@group(0) @binding(1) var kernel: texture_2d<f32>;
// Radiance, and the haze in alpha.
@group(0) @binding(2) var color: texture_2d<f32>;
@group(0) @binding(3) var coverage: texture_2d<f32>;
@group(0) @binding(4) var across: texture_2d<f32>;

fn weight(k: i32) -> f32 {
    return textureLoad(kernel, vec2i(k, 0), 0).r;
}

fn image_at(at: vec2i) -> vec4f {
    return gain.x * clamp(textureLoad(color, at, 0), vec4f(-largest), vec4f(largest));
}

fn hazy_at(at: vec2i) -> vec3f {
    let texel = image_at(at);
    return texel.a * texel.rgb;
}

// Along rows; outside the image is black.
@fragment
fn bloom_across(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    let width = i32(textureDimensions(color).x);
    let radius = i32(textureDimensions(kernel).x) - 1;
    var sum = vec3f(0.0);
    for (var x = max(at.x - radius, 0); x <= min(at.x + radius, width - 1); x++) {
        sum += weight(abs(x - at.x)) * hazy_at(vec2i(x, at.y));
    }
    return vec4f(sum, 0.0);
}

// Along columns, and added.
@fragment
fn bloom_down(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2i(position.xy);
    let height = i32(textureDimensions(color).y);
    let radius = i32(textureDimensions(kernel).x) - 1;
    var sum = image_at(at).rgb;
    for (var y = max(at.y - radius, 0); y <= min(at.y + radius, height - 1); y++) {
        sum += weight(abs(y - at.y)) * textureLoad(across, vec2i(at.x, y), 0).rgb;
    }
    return vec4f(sum, textureLoad(coverage, at, 0).r);
}
