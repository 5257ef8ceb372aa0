@compute @workgroup_size(64)
fn cs_texels(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let i = id.x + 64u * workgroups.x * id.y;
    if (i >= arrayLength(&texels)) {
        return;
    }
    let listed = texels[i];
    let here = vec2i(i32(listed.x & 0xffffu), i32(listed.x >> 16u));
