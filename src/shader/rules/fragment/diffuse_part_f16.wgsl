// diffuse (base_weight + rim_weight rim), in 16 bits; radiance beyond their range is cut at 65504.
//
// gives: diffuse_part
// when: rim, f16, !terms
// cost: 9
// error: 0.002
// paper: yes
fn diffuse_light_f16(
    albedo: vec3f,
    irradiance: vec3f,
    occ: f32,
    rim: f32,
    base_weight: vec3f,
    rim_weight: vec3f,
) -> vec3f {
    let light = vec3h(min(irradiance, vec3f(65504.0)));
    let weight = vec3h(base_weight) + f16(rim) * vec3h(rim_weight);
    return vec3f(min(vec3h(albedo) * light * (f16(occ) * weight), vec3h(65504.0)));
}
