// What is not skin, by its glTF material (metallic-roughness) under the scene's light, after what places the mesh. The
// CPU's samples trace rays (`samples::plain`); fragments look along as many directions and ask harmonics of places around
// them what stands in the way (`samples::plain_spread`).

// Samples of a pixel that the hardware keeps.
override multisamples: u32 = 1u;
// Directions of each of the two kinds that are looked along.
const DIRECTIONS = 32u;
const PI = 3.14159265358979;
const DIELECTRIC_F0 = 0.04;
const LEAST_ALPHA = 1e-3;
const LEAST_FACING = 1e-4;

struct Light {
    // The unit vector towards parallel light, or with w = 1 the position of a lamp.
    source: vec4f,
    strength: vec4f,
}

struct PlainVaryings {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) tint: vec4f,
    // Weights of the second and the third corner.
    @location(4) shares: vec2f,
    @location(5) @interpolate(flat) triangle: u32,
}

struct Frame {
    // Samples along a pixel's side.
    axis: u32,
    // What the sky's texels are to be multiplied by.
    brightness: f32,
}

// Of each place two rows of the first eight harmonics of each side; one of both last ones, and of which sides any eye sees
// (1 or 0); and those of the lights.
@group(2) @binding(0) var<storage, read> rows: array<vec4f>;
// Of each triangle the number of its first place, and the steps along a side.
@group(2) @binding(1) var<storage, read> spread: array<vec2u>;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
// Each level is the mean of the one before. Without an environment a level of black.
@group(2) @binding(3) var sky: texture_cube<f32>;
@group(2) @binding(4) var sky_sampler: sampler;
@group(2) @binding(5) var<uniform> frame: Frame;
@group(1) @binding(3) var roughness_map: texture_2d<f32>;
@group(1) @binding(4) var roughness_sampler: sampler;
@group(1) @binding(5) var emission_map: texture_2d<f32>;
@group(1) @binding(6) var emission_sampler: sampler;

struct Surface {
    diffuse: vec3f,
    f0: vec3f,
    alpha: f32,
    emission: vec3f,
}

// The three places around a fragment: where their rows begin, and what each counts.
struct Around {
    rows: vec3u,
    shares: vec3f,
}

// Harmonics of what stands in the way on the side that is seen.
struct Blocked {
    first: vec4f,
    second: vec4f,
    last: f32,
}

// What is seen from where: unit vectors, and the cosine between them; and what stands in the way there.
struct Seen {
    normal: vec3f,
    view: vec3f,
    facing: f32,
    blocked: Blocked,
}

fn unit_or_zero(v: vec3f) -> vec3f {
    return normalize_or(v, vec3f(0.0));
}

fn surface(at: PlainVaryings) -> Surface {
    let base = clamp(base_color(at.uv, at.tint).rgb, vec3f(0.0), vec3f(1.0));
    let read = textureSampleLevel(roughness_map, roughness_sampler, at.uv, 0.0);
    let metal = clamp(material.factors.x * read.b, 0.0, 1.0);
    let roughness = clamp(material.factors.y * read.g, 0.0, 1.0);
    let glow = material.emission.rgb * textureSampleLevel(emission_map, emission_sampler, at.uv, 0.0).rgb;
    return Surface(
        base * (1.0 - metal),
        mix(vec3f(DIELECTRIC_F0), base, metal),
        max(roughness * roughness, LEAST_ALPHA),
        max(glow, vec3f(0.0)),
    );
}

fn schlick(v_h: f32) -> f32 {
    let c = 1.0 - clamp(v_h, 0.0, 1.0);
    return c * c * c * c * c;
}

fn fresnel(s: Surface, v_h: f32) -> vec3f {
    return s.f0 + (1.0 - s.f0) * schlick(v_h);
}

fn diffuse_towards(s: Surface, v_h: f32) -> vec3f {
    return s.diffuse * ((1.0 - DIELECTRIC_F0) * (1.0 - schlick(v_h)));
}

// GGX's distribution, from the squared sine and cosine of (N, H).
fn distribution(sine_squared: f32, cosine_squared: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let spread = a2 * cosine_squared + sine_squared;
    return a2 / (PI * spread * spread);
}

// Smith's height-correlated masking over 4 (N.L)(N.V).
fn masking(n_l: f32, n_v: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    return 0.5 / (n_v * sqrt(a2 + (1.0 - a2) * n_l * n_l) + n_l * sqrt(a2 + (1.0 - a2) * n_v * n_v));
}

// The places around a fragment, on the even grid over its triangle (Yuksel et al. 2010, Mesh Colors).
fn nearest_places(at: PlainVaryings) -> Around {
    let triangle = spread[at.triangle];
    let steps = triangle.y;
    // The middle of a pixel that the hardware multisamples may lie beside the triangle.
    let held = clamp(at.shares, vec2f(0.0), vec2f(1.0));
    let along = held / max(held.x + held.y, 1.0) * f32(steps);
    let i = min(u32(along.x), steps - 1u);
    let j = min(u32(along.y), steps - 1u - i);
    let part = along - vec2f(f32(i), f32(j));
    // Row i has steps + 1 - i places.
    let own = triangle.x + i * (2u * steps + 3u - i) / 2u + j;
    let next = own + steps + 1u - i;
    if (part.x + part.y <= 1.0 || i + j + 2u > steps) {
        return Around(ROWS * vec3u(own, next, own + 1u), vec3f(1.0 - part.x - part.y, part));
    }
    return Around(ROWS * vec3u(next + 1u, own + 1u, next), vec3f(part.x + part.y - 1.0, 1.0 - part.x, 1.0 - part.y));
}

// The same, of which none counts whose side is seen from nowhere, unless all are such.
fn around(at: PlainVaryings, behind: bool) -> Around {
    let near = nearest_places(at);
    let side = select(2u, 3u, behind);
    let seen = vec3f(rows[near.rows.x + 4u][side], rows[near.rows.y + 4u][side], rows[near.rows.z + 4u][side]);
    let shares = max(near.shares, vec3f(0.0)) * seen;
    let sum = shares.x + shares.y + shares.z;
    return Around(near.rows, select(near.shares, shares / max(sum, 1e-6), sum > 1e-6));
}

fn row_around(a: Around, row: u32) -> vec4f {
    return a.shares.x * rows[a.rows.x + row] + a.shares.y * rows[a.rows.y + row] + a.shares.z * rows[a.rows.z + row];
}

fn blocked_around(a: Around, behind: bool) -> Blocked {
    let first = select(0u, 2u, behind);
    let last = row_around(a, 4u);
    return Blocked(row_around(a, first), row_around(a, first + 1u), select(last.x, last.y, behind));
}

// The share of the light along d that nothing stands in the way of: 1 less harmonics of three bands.
fn open_along(b: Blocked, d: vec3f) -> f32 {
    let second = vec4f(d.x * d.z, d.x * d.y, 1.5 * d.y * d.y - 0.5, d.y * d.z) * vec4f(1.0925484306, 1.0925484306, 0.6307831305, 1.0925484306);
    let blocked = dot(b.first, vec4f(0.2820947918, 0.4886025119 * d.x, 0.4886025119 * d.y, 0.4886025119 * d.z))
        + dot(b.second, second)
        + b.last * 0.5462742153 * (d.z * d.z - d.x * d.x);
    return clamp(1.0 - blocked, 0.0, 1.0);
}

// The mean radiance about d over a solid angle.
fn sky_along(d: vec3f, solid_angle: f32) -> vec3f {
    let held = clamp(solid_angle, 1e-6, 4.0 * PI);
    let texels = sqrt(4.0 * PI / (6.0 * held));
    let level = log2(f32(textureDimensions(sky).x) / texels);
    return frame.brightness * textureSampleLevel(sky, sky_sampler, d, max(level, 0.0)).rgb;
}

// A frame with Z along n and X in the plane of the view: the same directions about that wherever the surface is seen from.
// Seen straight from above any will do.
fn frame_about(n: vec3f, view: vec3f) -> mat3x3f {
    let across = cross(n, view);
    let other = cross(n, select(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), abs(n.z) > 0.5));
    let y = unit_or_zero(select(other, across, dot(across, across) > 1e-10));
    return mat3x3f(cross(y, n), y, n);
}

// Reflected light of the environment: filtered importance sampling (Krivanek and Colbert 2008), by the cosine and by
// GGX's distribution of half vectors, over Hammersley's points.
fn of_sky(s: Surface, seen: Seen) -> vec3f {
    let turned = frame_about(seen.normal, seen.view);
    let each = f32(DIRECTIONS);
    var sum = vec3f(0.0);
    for (var i = 0u; i < DIRECTIONS; i++) {
        let u = (f32(i) + 0.5) / each;
        let turn = 2.0 * PI * f32(reverseBits(i)) / 4294967296.0;
        let side = vec2f(cos(turn), sin(turn));
        let up = sqrt(1.0 - u);
        let toward = turned * vec3f(sqrt(u) * side, up);
        let v_h = dot(seen.view, unit_or_zero(toward + seen.view));
        let light = open_along(seen.blocked, toward) * sky_along(toward, PI / (each * max(up, 1e-3)));
        sum += diffuse_towards(s, v_h) / each * light;

        // tan^2 of the half vector's angle.
        let tangent = s.alpha * s.alpha * u / (1.0 - u);
        let cosine = inverseSqrt(1.0 + tangent);
        let half_way = turned * vec3f(sqrt(tangent) * cosine * side, cosine);
        let v_half = dot(seen.view, half_way);
        let mirrored = 2.0 * v_half * half_way - seen.view;
        let n_l = dot(seen.normal, mirrored);
        if (n_l > 0.0 && v_half > 0.0) {
            let density = distribution(tangent * cosine * cosine, cosine * cosine, s.alpha) * cosine / (4.0 * v_half);
            let masked = masking(n_l, seen.facing, s.alpha) * 4.0 * n_l * seen.facing;
            let weight = masked * v_half / (seen.facing * cosine * each);
            let bright = open_along(seen.blocked, mirrored) * sky_along(mirrored, 1.0 / (each * density));
            sum += weight * fresnel(s, v_half) * bright;
        }
    }
    return sum;
}

// Reflected light of one light, of whose strength so much arrives.
fn of_light(at: PlainVaryings, light: Light, arriving: f32, s: Surface, seen: Seen) -> vec3f {
    let toward = select(light.source.xyz, unit_or_zero(light.source.xyz - at.position), light.source.w > 0.5);
    let n_l = dot(seen.normal, toward);
    if (!(n_l > 0.0)) {
        return vec3f(0.0);
    }
    let half_way = unit_or_zero(toward + seen.view);
    let across = cross(seen.normal, half_way);
    let n_h = dot(seen.normal, half_way);
    let v_h = max(dot(seen.view, half_way), 0.0);
    let lobe = distribution(dot(across, across), n_h * n_h, s.alpha) * masking(n_l, seen.facing, s.alpha);
    return (diffuse_towards(s, v_h) / PI + fresnel(s, v_h) * lobe) * light.strength.rgb * (arriving * n_l);
}

// The radiance that leaves towards the eye; `plane` is a normal of the triangle, of any length and sign. Both sides are
// drawn, each as the front.
fn radiance(at: PlainVaryings, plane: vec3f) -> vec3f {
    let s = surface(at);
    let view = unit_or_zero(constants.eye.xyz - at.position);
    var normal = unit_or_zero(at.normal);
    if (all(normal == vec3f(0.0)) || all(view == vec3f(0.0))) {
        return s.emission;
    }
    // Near the silhouette of a coarse mesh the smooth normal may face away where the triangle does not.
    let behind = dot(plane, normal) * dot(plane, view) < 0.0;
    normal = select(normal, -normal, behind);
    let cosine = dot(normal, view);
    if (cosine < LEAST_FACING) {
        normal = unit_or_zero(normal + (LEAST_FACING - cosine) * view);
    }
    let a = around(at, behind);
    let seen = Seen(normal, view, max(dot(normal, view), LEAST_FACING), blocked_around(a, behind));
    var sum = s.emission;
    if (SKY) {
        sum += of_sky(s, seen);
    }
    for (var i = 0u; i < LIGHTS; i++) {
        sum += of_light(at, lights[i], row_around(a, LIGHT_ROWS + i / 4u)[i % 4u], s, seen);
    }
    return select(vec3f(0.0), max(sum, vec3f(0.0)), is_finite(sum));
}

// Above this alpha the kth of a pixel's samples shows the layer: even over the pixel's, in an order of each triangle's
// own, so that the mean over them is blended in any order (Enderton et al. 2010, Stochastic Transparency, stratified).
fn threshold(k: u32, count: u32, seed: u32) -> f32 {
    let own = hashed(k ^ seed);
    var rank = 0u;
    for (var i = 0u; i < count; i++) {
        // The hash is one to one: no two are alike.
        rank += select(0u, 1u, hashed(i ^ seed) < own);
    }
    return (f32(rank) + f32(hashed(~seed) >> 8u) / 16777216.0) / f32(count);
}

// Which of the samples that the hardware keeps of a fragment show it; one, where it keeps one.
fn samples_shown(at: PlainVaryings) -> u32 {
    let all = (1u << multisamples) - 1u;
    if (material.factors.z < 0.5) {
        return all;
    }
    let alpha = clamp(base_color(at.uv, at.tint).a, 0.0, 1.0);
    if (material.factors.z < 1.5) {
        return select(0u, all, alpha >= material.emission.a);
    }
    let fragment = vec2u(at.clip.xy);
    let axis = frame.axis;
    let pixel = fragment / axis;
    let seed = hashed(pixel.x ^ hashed(pixel.y ^ hashed(at.triangle)));
    let first = ((fragment.x % axis) + axis * (fragment.y % axis)) * multisamples;
    let count = axis * axis * multisamples;
    var mask = 0u;
    for (var k = 0u; k < multisamples; k++) {
        if (alpha > threshold(first + k, count, seed)) {
            mask |= 1u << k;
        }
    }
    return mask;
}
