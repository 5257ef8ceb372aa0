// The mirrored light: dapple E_s(R).rgb (MODEL 3).
//
// gives: mirror_term
// cost: 3
fn dappled_mirror(dapple: f32, mirror_light: vec4f) -> vec3f {
    return dapple * mirror_light.rgb;
}
