// hilite occ rim a E_h(V): back light that shines past the rim (MODEL 3).
//
// gives: hilite_part
// adds: hilite
// cost: 5
fn back_light(hilite_term: vec3f, occ: f32, rim: f32, hilite: vec3f) -> vec3f {
    return hilite * (occ * rim) * hilite_term;
}
