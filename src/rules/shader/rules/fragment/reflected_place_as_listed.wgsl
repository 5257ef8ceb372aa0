// Where the reflection meets the cubes, of any length in the listing.
//
// gives: reflected_place
// when: listing
// cost: 16
// uses: vector, cube
fn place_of_reflected_as_listed(reflected_in_environment: vec3f) -> vec3f {
    return cube_place(reflected_in_environment);
}
