// Without a normal map n is the smooth normal, not normalised (listing 3-4); below 1e-37 it is noise, and -V
// stands in (MODEL 7).
//
// gives: n
// when: !bumped, listing, raster
// cost: 5
// uses: vector
fn n_smooth_as_listed(vertex_normal: vec3f, view: vec3f) -> vec3f {
    let size: f32 = abs(vertex_normal.x) + abs(vertex_normal.y) + abs(vertex_normal.z);
    return select(vertex_normal, -view, size < 1e-37 || !is_finite(vertex_normal));
}
