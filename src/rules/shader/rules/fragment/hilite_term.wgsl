// The hilite: a E_h(V) (MODEL 3).
//
// gives: hilite_term
// cost: 3
fn attenuated_hilite(attenuator: f32, hilite_light: vec3f) -> vec3f {
    return attenuator * hilite_light;
}
