// The smooth normal N of unit length; +Z where it vanishes, whatever the eye sees. That needs no V, and
// nearly no mesh has such a fragment.
//
// gives: normal
// when: raster
// cost: 9
// error: 1e-6
// paper: yes
// uses: vector
fn smooth_normal_unguarded(vertex_normal: vec3f) -> vec3f {
    return normalize_or(vertex_normal, vec3f(0.0, 0.0, 1.0));
}
