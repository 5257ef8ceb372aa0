// Nothing is reflected above the skin: all light enters.
//
// gives: entering
// when: layered, !fresnel
// cost: 0
fn all_enters() -> vec3f {
    return vec3f(1.0);
}
