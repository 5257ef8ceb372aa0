// Without a normal map n is the smooth normal, not normalised (listing 3-4).
//
// gives: n
// when: !bumped, listing, raster
// cost: 4
// uses: vector
fn n_smooth_as_listed(vertex_normal: vec3f, view: vec3f) -> vec3f {
    return select(vertex_normal, -view, is_zero(vertex_normal));
}
