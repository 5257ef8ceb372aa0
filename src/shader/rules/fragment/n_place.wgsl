// Where the normal meets the cubes.
//
// gives: n_place
// cost: 16
// uses: vector, cube
fn place_of_n(n_in_environment: vec3f) -> vec3f {
    return cube_place(n_in_environment);
}
