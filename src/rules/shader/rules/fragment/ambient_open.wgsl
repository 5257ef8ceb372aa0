// Ambient light is occluded alike in all channels.
//
// gives: ambient_open
// domain: texel, fragment
// when: layered, !directional_occlusion
// cost: 0
fn occluded_alike(occ: f32) -> vec3f {
    return vec3f(occ);
}
