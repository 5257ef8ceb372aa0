// An image, or what two are apart, as a pane shows it.

struct Look {
    // The image's point at the pane's upper left corner, and how many of its pixels the pane is across.
    origin: vec2f,
    span: vec2f,
    // Pixels of the image that a pixel of the pane is across.
    step: vec2f,
    // Factor on radiance; what the end of an error's scale stands for.
    exposure: f32,
    scale: f32,
    // Where a wipe's line is, as a share of the pane; its width likewise.
    wipe: f32,
    line: f32,
    background: f32,
    kind: u32,
    tone: u32,
    false_colour: u32,
    // Whether the target takes sRGB-encoded numbers.
    encoded: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> look: Look;
@group(0) @binding(1) var first: texture_2d<f32>;
@group(0) @binding(2) var second: texture_2d<f32>;
// Two rows: from 0 to 1, and from -1 to 1.
@group(0) @binding(3) var ramps: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn corner(@builtin(vertex_index) i: u32) -> Corner {
    let uv = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return Corner(vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0), uv);
}

// The mean of what a pixel of the pane covers of an image: four by four of its texels where those are smaller.
fn at(image: texture_2d<f32>, p: vec2f) -> vec4f {
    let size = vec2f(textureDimensions(image));
    if look.step.x <= 1.0 {
        return textureLoad(image, vec2i(p), 0);
    }
    let n = 4;
    var sum = vec4f(0.0);
    for (var y = 0; y < n; y++) {
        for (var x = 0; x < n; x++) {
            let q = p + ((vec2f(f32(x), f32(y)) + 0.5) / f32(n) - 0.5) * look.step;
            sum += textureLoad(image, vec2i(clamp(floor(q), vec2f(0.0), size - 1.0)), 0);
        }
    }
    return sum / f32(n * n);
}

fn luminance(c: vec3f) -> f32 {
    return dot(c, vec3f(0.2126, 0.7152, 0.0722));
}

// Of numbers in [0, 1].
fn encode(c: vec3f) -> vec3f {
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

fn decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

// As render::tonemap::Operator::apply.
fn toned(radiance: vec3f) -> vec3f {
    let c = clamp(radiance, vec3f(0.0), vec3f(1e6));
    var curve = c;
    if look.tone == 1u {
        curve = c / (1.0 + luminance(c));
    } else if look.tone == 2u {
        curve = (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14);
    }
    return clamp(curve, vec3f(0.0), vec3f(1.0));
}

// sRGB-encoded: row 0 takes [0, 1], row 1 [-1, 1].
fn ramp(t: f32, row: i32) -> vec3f {
    let u = select(t, 0.5 * t + 0.5, row == 1);
    return textureLoad(ramps, vec2i(i32(clamp(u, 0.0, 1.0) * 255.0 + 0.5), row), 0).rgb;
}

// sRGB-encoded.
fn shown(texel: vec4f) -> vec3f {
    let radiance = (texel.rgb + (1.0 - texel.a) * look.background) * look.exposure;
    if look.false_colour == 1u {
        // From 8 stops below white to 2 above it.
        return ramp((log2(max(luminance(radiance), 1e-10)) + 8.0) / 10.0, 0);
    }
    return encode(toned(radiance));
}

// sRGB-encoded: what of an error is not compared is grey.
fn error(a: vec4f, b: vec4f) -> vec3f {
    if a.a < 0.5 {
        return encode(vec3f(look.background));
    }
    let apart = dot(a.rgb - b.rgb, vec3f(1.0 / 3.0));
    if look.kind == 1u {
        return ramp(apart / look.scale, 1);
    }
    if look.kind == 2u {
        return ramp(abs(apart) / (max(dot(b.rgb, vec3f(1.0 / 3.0)), 1e-3) * look.scale), 0);
    }
    return ramp(a.r / look.scale, 0);
}

@fragment
fn pixel(in: Corner) -> @location(0) vec4f {
    let p = look.origin + in.uv * look.span;
    let size = vec2f(textureDimensions(first));
    var rgb: vec3f;
    if any(p < vec2f(0.0)) || any(p >= size) {
        rgb = vec3f(0.13);
    } else if look.kind == 4u {
        let beyond = in.uv.x - look.wipe;
        if abs(beyond) < look.line {
            rgb = vec3f(1.0, 0.85, 0.2);
        } else if beyond < 0.0 {
            rgb = shown(at(first, p));
        } else {
            rgb = shown(at(second, p));
        }
    } else if look.kind == 0u {
        rgb = shown(at(first, p));
    } else {
        rgb = error(at(first, p), at(second, p));
    }
    if look.encoded == 0u {
        rgb = decode(rgb);
    }
    return vec4f(rgb, 1.0);
}
