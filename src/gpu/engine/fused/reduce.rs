//! Sums of many threads in a fixed order: a thread's to its workgroup's, those of all workgroups to a few.

use std::fmt::Write as _;

use super::{PARTS, WORKGROUP};

/// Sums that a workgroup's threads add up together.
const AT_ONCE: usize = 16;

// Each thread has an equal share of the work, or numbers would be left out.
const _: () =
    assert!((WORKGROUP as usize).is_multiple_of(AT_ONCE) && (WORKGROUP as usize).is_multiple_of(PARTS));

/// The function that adds up a workgroup's sums, and what it works in.
pub(super) fn functions() -> String {
    let team = WORKGROUP as usize / AT_ONCE;
    let lanes = WORKGROUP as usize * AT_ONCE;
    format!(
        "// Threads of a workgroup; sums that they add up at once, and the threads for each of those.\n\
         const THREADS = {WORKGROUP}u;\nconst AT_ONCE = {AT_ONCE}u;\nconst TEAM = {team}u;\n\
         var<workgroup> lanes: array<f32, {lanes}>;\n\n{}",
        include_str!("reduce.wgsl")
    )
}

/// The shader that adds up the workgroups' sums, a workgroup for each: `partial_sums` in, `PARTS` numbers a sum
/// out. Bindings of group 0: the counts, what is read, what is written.
#[must_use]
pub fn gather_module() -> String {
    let each = WORKGROUP as usize / PARTS;
    format!(
        "struct Gathered {{\n    // Workgroups that left sums, and where they start.\n    workgroups: u32,\n    first_sum: u32,\n    // Where the results go.\n    first_result: u32,\n}}\n\n\
         @group(0) @binding(0) var<uniform> gathered: Gathered;\n\
         @group(0) @binding(1) var<storage, read> partial_sums: array<f32>;\n\
         @group(0) @binding(2) var<storage, read_write> results: array<f32>;\n\n\
         @compute @workgroup_size({WORKGROUP})\nfn cs_main(@builtin(local_invocation_index) thread: u32, @builtin(workgroup_id) which: vec3u) {{\n\
         \x20   let first = gathered.first_sum + which.x * gathered.workgroups;\n    var sum = 0.0;\n\
         \x20   for (var i = thread; i < gathered.workgroups; i += {WORKGROUP}u) {{\n        sum += partial_sums[first + i];\n    }}\n\
         \x20   lanes[thread] = sum;\n    workgroupBarrier();\n    if (thread < {PARTS}u) {{\n        var total = 0.0;\n\
         \x20       for (var k = 0u; k < {each}u; k++) {{\n            total += lanes[{each}u * thread + k];\n        }}\n\
         \x20       results[gathered.first_result + which.x * {PARTS}u + thread] = total;\n    }}\n}}\n\nvar<workgroup> lanes: array<f32, {WORKGROUP}>;\n"
    )
}

/// The end of the entry point: a thread's sums to the workgroup's.
pub(super) fn reduction(count: usize) -> String {
    let mut wgsl = String::new();
    for first in (0..count).step_by(AT_ONCE) {
        let here = (count - first).min(AT_ONCE);
        for e in 0..AT_ONCE {
            let value = if e < here { format!("sum{}", first + e) } else { "0.0".to_owned() };
            let _ = writeln!(wgsl, "    lanes[{}u + thread] = {value};", WORKGROUP as usize * e);
        }
        let _ = writeln!(
            wgsl,
            "    let total{first} = sums_of_lanes(thread);\n    if (thread < {here}u) {{\n        partial_sums[part.first_sum + ({first}u + thread) * workgroups.x + workgroup.x] = total{first};\n    }}"
        );
    }
    wgsl.push_str("}\n");
    wgsl
}
