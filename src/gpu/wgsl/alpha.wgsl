// The numbers of a glTF material, and its colour with alpha: for the fragments that show it and for those of shadow maps.

struct Material {
    base_color: vec4f,
    // The last: below this alpha there is a hole.
    emission: vec4f,
    // Metal and roughness; then 0 where alpha does nothing, 1 where it cuts holes, 2 where it is the share that is seen.
    factors: vec4f,
}

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var color_map: texture_2d<f32>;
@group(1) @binding(2) var color_sampler: sampler;

fn base_color(uv: vec2f, tint: vec4f) -> vec4f {
    return material.base_color * textureSampleLevel(color_map, color_sampler, uv, 0.0) * tint;
}

fn hashed(x: u32) -> u32 {
    var h = (x ^ (x >> 16u)) * 0x85ebca6bu;
    h = (h ^ (h >> 13u)) * 0xc2b2ae35u;
    return h ^ (h >> 16u);
}
