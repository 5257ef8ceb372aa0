// diffuse (base_weight + rim_weight rim), in 16 bits; radiance beyond their range is cut at 65504.
//
// gives: diffuse_part
// adds: diffuse, rim
// when: rim, f16, !layered
// cost: 6
// error: 0.002
// paper: yes
fn diffuse_light_f16(diffuse_term: vec3f, occ: f32, rim: f32, base_weight: vec3f, rim_weight: vec3f) -> vec3f {
    let weight = vec3h(base_weight) + f16(rim) * vec3h(rim_weight);
    let light = vec3h(min(diffuse_term, vec3f(65504.0)));
    return vec3f(min(light * (f16(occ) * weight), vec3h(65504.0)));
}
