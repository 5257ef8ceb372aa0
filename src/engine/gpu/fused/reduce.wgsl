// Sums of a workgroup's 128 threads, sixteen numbers at a time: in the same order whenever it runs.
var<workgroup> lanes: array<f32, 2048>;

// The sum over all threads of what stands in lanes[128 e + thread], for e below 16: thread e gets the e-th.
fn sums_of_lanes(thread: u32) -> f32 {
    workgroupBarrier();
    let first = (thread / 8u) * 128u + thread % 8u;
    var sum = 0.0;
    for (var k = 0u; k < 128u; k += 8u) {
        sum += lanes[first + k];
    }
    workgroupBarrier();
    lanes[thread] = sum;
    workgroupBarrier();
    var total = 0.0;
    if (thread < 16u) {
        for (var k = 0u; k < 8u; k++) {
            total += lanes[8u * thread + k];
        }
    }
    workgroupBarrier();
    return total;
}
