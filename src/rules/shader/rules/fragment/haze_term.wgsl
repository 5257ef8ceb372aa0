// dapple a E_s(R).a, the haze before its weight (MODEL 3).
//
// gives: haze_term
// cost: 2
fn dappled_haze(mirror_light: vec4f, dapple: f32, attenuator: f32) -> f32 {
    return dapple * mirror_light.a * attenuator;
}
