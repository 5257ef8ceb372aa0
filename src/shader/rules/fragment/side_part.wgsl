// side_specular s E_s(n) (MODEL 3).
//
// gives: side_part
// cost: 6
fn side_specular_light(specular: f32, side_light: vec3f, side_specular: vec3f) -> vec3f {
    return specular * side_specular * side_light;
}
