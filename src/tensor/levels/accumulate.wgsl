// The adjoint of what a blur reads: sums, to be added to what it has of other passes. `largest` is that of what the blur leaves, of
// which each texel that is read gets a share.

struct Part {
    // Where the adjoints of what a blur leaves begin, those of what it reads, and how many numbers each has.
    leaf: u32,
    source: u32,
    numbers: u32,
    headroom: i32,
    // Whether other passes have added to it before.
    more: u32,
}

@group(0) @binding(0) var<uniform> part: Part;
@group(0) @binding(1) var<storage, read_write> adjoints: array<f32>;
@group(0) @binding(2) var<storage, read_write> largest: atomic<u32>;
@group(0) @binding(3) var<storage, read_write> sums: array<atomic<u32>>;

// The largest number, by its bits: those of floats that are not negative are in the floats' order.
@compute @workgroup_size(64)
fn cs_largest(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i < part.numbers {
        atomicMax(&largest, bitcast<u32>(abs(adjoints[part.leaf + i])));
    }
}

fn accumulate(i: u32, sum: f32) {
    let before = select(0.0, adjoints[part.source + i], part.more != 0u);
    adjoints[part.source + i] = before + sum;
}

@compute @workgroup_size(64)
fn cs_exact(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i < part.numbers {
        accumulate(i, exact_sum(i, part.headroom));
    }
}

@compute @workgroup_size(64)
fn cs_fast(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if i < part.numbers {
        accumulate(i, fast_sum(i));
    }
}
