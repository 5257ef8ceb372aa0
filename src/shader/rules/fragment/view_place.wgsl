// Where the view meets the cubes.
//
// gives: view_place
// cost: 16
// uses: vector, cube
fn place_of_view(view_in_environment: vec3f) -> vec3f {
    return cube_place(view_in_environment);
}
