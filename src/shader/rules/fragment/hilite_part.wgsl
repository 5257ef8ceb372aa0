// hilite occ rim a E_h(V): back light that shines past the rim (MODEL 3).
//
// gives: hilite_part
// cost: 8
fn back_light(hilite_light: vec3f, attenuator: f32, occ: f32, rim: f32, hilite: vec3f) -> vec3f {
    return hilite * (occ * rim * attenuator) * hilite_light;
}
