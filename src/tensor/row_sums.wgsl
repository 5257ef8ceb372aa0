// Sums of 64 rows each, in a fixed tree: [rows, columns] to [ceil(rows / 64), columns]. A workgroup a sum.

struct Size {
    rows: u32,
    columns: u32,
}

@group(0) @binding(0) var<uniform> size: Size;
@group(0) @binding(1) var<storage, read_write> given: array<f32>;
@group(0) @binding(2) var<storage, read_write> sums: array<f32>;

var<workgroup> tree: array<f32, 64>;

@compute @workgroup_size(64)
fn cs_main(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
) {
    let i = workgroup.x + workgroup.y * workgroups.x;
    let row = i / size.columns * 64u + thread;
    let column = i % size.columns;
    tree[thread] = 0.0;
    if row < size.rows {
        tree[thread] = given[row * size.columns + column];
    }
    for (var half = 32u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if thread < half {
            tree[thread] += tree[thread + half];
        }
    }
    if thread == 0u && i < (size.rows + 63u) / 64u * size.columns {
        sums[i] = tree[0];
    }
}
