// Where the normal meets the cubes, of any length in the listing.
//
// gives: n_place
// domain: texel, fragment
// when: listing
// cost: 16
// uses: vector, cube
fn place_of_n_as_listed(n_in_environment: vec3f) -> vec3f {
    return cube_place(n_in_environment);
}
