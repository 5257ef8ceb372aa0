
@compute @workgroup_size(64)
fn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let i = id.x + 64u * workgroups.x * id.y;
    if (i >= arrayLength(&texels)) {
        return;
    }
    let here = vec2i(i32(texels[i].x) % SIZE, i32(texels[i].x) / SIZE);
