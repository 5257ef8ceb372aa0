// Where the view meets the cubes, of any length in the listing.
//
// gives: view_place
// when: listing
// cost: 16
// uses: vector, cube
fn place_of_view_as_listed(view_in_environment: vec3f) -> vec3f {
    return cube_place(view_in_environment);
}
