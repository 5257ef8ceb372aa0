// Which samples show something: a bit for each, 32 of a row in a word.

// Samples across and down, and words a row.
@group(0) @binding(0) var<uniform> size: vec4u;
// 0 where nothing was drawn.
@group(0) @binding(1) var depth: texture_depth_2d;
@group(0) @binding(2) var<storage, read_write> words: array<u32>;

@compute @workgroup_size(64)
fn cs_main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= size.z || id.y >= size.y) {
        return;
    }
    let first = 32u * id.x;
    var word = 0u;
    for (var k = 0u; k < min(32u, size.x - first); k++) {
        if (textureLoad(depth, vec2u(first + k, id.y), 0) > 0.0) {
            word |= 1u << k;
        }
    }
    words[id.y * size.z + id.x] = word;
}
