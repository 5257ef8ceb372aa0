// Where the normal meets the cubes: a unit vector.
//
// gives: n_place
// domain: texel, fragment
// when: corrected
// cost: 16
// uses: vector, cube
fn place_of_n(n_in_environment: vec3f) -> vec3f {
    return cube_place_of_unit(n_in_environment);
}
