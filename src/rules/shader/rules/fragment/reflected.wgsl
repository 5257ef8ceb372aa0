// R = V - 2 n (n.V) (MODEL 3, corrected form).
//
// gives: reflected
// when: corrected
// cost: 7
fn mirror_direction(lookup_normal: vec3f, view: vec3f) -> vec3f {
    return view - 2.0 * dot(lookup_normal, view) * lookup_normal;
}
