// Samples to pixels: means over squares of n x n. Uncovered samples are zero, so that the mean is radiance
// premultiplied by coverage.
override n: u32 = 1u;
// What lies beyond is cut there: the largest number of the samples' format.
override largest: f32 = 65504.0;

// The tile's first pixel.
@group(0) @binding(0) var<uniform> origin: vec4u;
@group(0) @binding(1) var color_samples: texture_2d<f32>;
@group(0) @binding(2) var coverage_samples: texture_2d<f32>;

struct Pixel {
    @location(0) color: vec4f,
    @location(1) coverage: f32,
}

fn first_sample(position: vec4f) -> vec2u {
    return (vec2u(position.xy) - origin.xy) * n;
}

fn mean_color(first: vec2u) -> vec4f {
    var sum = vec4f(0.0);
    for (var y = 0u; y < n; y++) {
        for (var x = 0u; x < n; x++) {
            sum += clamp(textureLoad(color_samples, first + vec2u(x, y), 0), vec4f(-largest), vec4f(largest));
        }
    }
    return sum / f32(n * n);
}

// What blooms: radiance times haze, sample by sample.
@fragment
fn resolve_glow(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let first = first_sample(position);
    var sum = vec3f(0.0);
    for (var y = 0u; y < n; y++) {
        for (var x = 0u; x < n; x++) {
            let texel = textureLoad(color_samples, first + vec2u(x, y), 0);
            let held = clamp(texel, vec4f(-largest), vec4f(largest));
            sum += clamp(held.a * held.rgb, vec3f(-largest), vec3f(largest));
        }
    }
    return vec4f(sum / f32(n * n), 0.0);
}

@fragment
fn resolve(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return mean_color(first_sample(position));
}

@fragment
fn resolve_hazy(@builtin(position) position: vec4f) -> Pixel {
    let first = first_sample(position);
    var coverage = 0.0;
    for (var y = 0u; y < n; y++) {
        for (var x = 0u; x < n; x++) {
            coverage += textureLoad(coverage_samples, first + vec2u(x, y), 0).r;
        }
    }
    return Pixel(mean_color(first), coverage / f32(n * n));
}
