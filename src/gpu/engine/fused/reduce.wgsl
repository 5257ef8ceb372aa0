// Sums of a workgroup's threads, AT_ONCE numbers at a time: in the same order whenever it runs. The sum over all
// threads of what stands in lanes[THREADS e + thread], for e below AT_ONCE: thread e gets the e-th.
fn sums_of_lanes(thread: u32) -> f32 {
    workgroupBarrier();
    let first = (thread / TEAM) * THREADS + thread % TEAM;
    var sum = 0.0;
    for (var k = 0u; k < THREADS; k += TEAM) {
        sum += lanes[first + k];
    }
    workgroupBarrier();
    lanes[thread] = sum;
    workgroupBarrier();
    var total = 0.0;
    if (thread < AT_ONCE) {
        for (var k = 0u; k < TEAM; k++) {
            total += lanes[TEAM * thread + k];
        }
    }
    workgroupBarrier();
    return total;
}
