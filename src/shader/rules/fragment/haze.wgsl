// haze_weight dapple E_s(R).a a, which goes to alpha and drives the bloom (MODEL 3).
//
// gives: haze
// cost: 3
fn haze_of_reflection(mirror_light: vec4f, dapple: f32, attenuator: f32, haze_weight: f32) -> f32 {
    return haze_weight * dapple * mirror_light.a * attenuator;
}
