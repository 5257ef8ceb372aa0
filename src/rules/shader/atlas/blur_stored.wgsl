
// A workgroup takes 64 texels along the axis, in four lines side by side: what they read lies together.
@compute @workgroup_size(256)
fn cs_main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let tile = workgroup.x + workgroups.x * workgroup.y;
    if (tile >= arrayLength(&tiles)) {
        return;
    }
    let own = {own};
    let here = vec2i(i32(tiles[tile] & 0xffffu), i32(tiles[tile] >> 16u)) + own.x * {axis} + own.y * {across};
    if (!is_inside(here)) {
        return;
    }
    let middle = level_texel({source}, here);
    if (middle.w <= 0.0) {
        return;
    }
{weigh}    // Where none weighs anything, the texel as it is (MODEL 6).
    let weighs = sum.w > 0.0;
    let whole = select(1.0, sum.w, weighs);
    let mean = select(vec3f(0.0), sum.xyz / whole, weighs);
{leaves}}
