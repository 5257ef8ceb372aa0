// Levels that samples look up, from the atlas' buffers to a tensor, and what they get, back.

struct Part {
    texels: u32,
    // Numbers of a texel in the tensor, the first of which are the level's, and how many these are.
    width: u32,
    first: u32,
    numbers: u32,
    // Where the level begins, in texels.
    level: u32,
}

@group(0) @binding(0) var<uniform> part: Part;
// The texels that the mesh covers: their places, and charts.
@group(0) @binding(1) var<storage, read> texels: array<vec2u>;
@group(0) @binding(2) var<storage, read_write> levels: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> adjoints: array<f32>;
@group(0) @binding(4) var<storage, read_write> tensor: array<f32>;

@compute @workgroup_size(64)
fn cs_levels(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= part.texels {
        return;
    }
    let texel = levels[part.level + texels[i].x];
    for (var c = 0u; c < part.numbers; c++) {
        tensor[part.width * i + part.first + c] = texel[c];
    }
}

@compute @workgroup_size(64)
fn cs_adjoints(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= part.texels {
        return;
    }
    for (var c = 0u; c < part.numbers; c++) {
        adjoints[3u * (part.level + texels[i].x) + c] = tensor[part.width * i + part.first + c];
    }
}
