// N as interpolated, whose direction S.w tells.
//
// gives: dapple_normal
// when: raster
// cost: 0
fn normal_under_leaves(vertex_normal: vec3f) -> vec3f {
    return vertex_normal;
}
