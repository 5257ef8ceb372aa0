// Where the view meets the cubes: a unit vector.
//
// gives: view_place
// when: corrected
// cost: 16
// uses: vector, cube
fn place_of_view(view_in_environment: vec3f) -> vec3f {
    return cube_place_of_unit(view_in_environment);
}
