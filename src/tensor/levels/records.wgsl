// A number of each covered texel, from a tensor to the texels' records.

struct Part {
    texels: u32,
    // Numbers of a texel in the tensor, and which of them it is.
    width: u32,
    component: u32,
    // Its row in a record, and how many of these there are.
    row: u32,
    rows: u32,
}

@group(0) @binding(0) var<uniform> part: Part;
@group(0) @binding(1) var<storage, read_write> given: array<f32>;
@group(0) @binding(2) var<storage, read_write> records: array<f32>;

@compute @workgroup_size(64)
fn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i < part.texels {
        records[(i / 16u * part.rows + part.row) * 16u + i % 16u] = given[part.width * i + part.component];
    }
}
