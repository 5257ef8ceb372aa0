// haze_weight dapple E_s(R).a a, which goes to alpha and drives the bloom (MODEL 3).
//
// gives: haze
// cost: 1
fn haze_of_reflection(haze_term: f32, haze_weight: f32) -> f32 {
    return haze_weight * haze_term;
}
