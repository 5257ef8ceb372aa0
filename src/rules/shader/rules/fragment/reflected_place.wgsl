// Where the reflection meets the cubes: a unit vector.
//
// gives: reflected_place
// when: corrected
// cost: 16
// uses: vector, cube
fn place_of_reflected(reflected_in_environment: vec3f) -> vec3f {
    return cube_place_of_unit(reflected_in_environment);
}
