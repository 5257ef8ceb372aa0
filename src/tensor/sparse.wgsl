// A sparse matrix times a few columns at once: one thread a number of the product.

struct Size {
    rows: u32,
    channels: u32,
}

@group(0) @binding(0) var<uniform> size: Size;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> columns: array<u32>;
@group(0) @binding(3) var<storage, read> weights: array<f32>;
@group(0) @binding(4) var<storage, read_write> given: array<f32>;
@group(0) @binding(5) var<storage, read_write> product: array<f32>;

@compute @workgroup_size(64)
fn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= size.rows * size.channels {
        return;
    }
    let row = i / size.channels;
    let channel = i % size.channels;
    var sum = 0.0;
    for (var k = starts[row]; k < starts[row + 1u]; k++) {
        sum += weights[k] * given[columns[k] * size.channels + channel];
    }
    product[i] = sum;
}
