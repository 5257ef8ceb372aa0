// Where the reflection meets the cubes.
//
// gives: reflected_place
// cost: 16
// uses: vector, cube
fn place_of_reflected(reflected_in_environment: vec3f) -> vec3f {
    return cube_place(reflected_in_environment);
}
