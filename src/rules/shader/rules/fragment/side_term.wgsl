// Light from the side: s E_s(n) (MODEL 3).
//
// gives: side_term
// cost: 3
fn side_specular_term(specular: f32, side_light: vec3f) -> vec3f {
    return specular * side_light;
}
