// side_specular side (MODEL 3).
//
// gives: side_part
// adds: side_specular
// cost: 3
fn side_specular_light(side_term: vec3f, side_specular: vec3f) -> vec3f {
    return side_specular * side_term;
}
