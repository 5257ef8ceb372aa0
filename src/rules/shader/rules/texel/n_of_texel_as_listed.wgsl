// n of a texel without a normal map: the interpolated normal, not normalised (listing 3-4); +Y where it vanishes.
//
// gives: n
// when: !bumped, listing
// cost: 5
// uses: vector
fn n_of_texel_as_listed(vertex_normal: vec3f) -> vec3f {
    let size: f32 = abs(vertex_normal.x) + abs(vertex_normal.y) + abs(vertex_normal.z);
    return select(vertex_normal, vec3f(0.0, 1.0, 0.0), size < 1e-37 || !is_finite(vertex_normal));
}
