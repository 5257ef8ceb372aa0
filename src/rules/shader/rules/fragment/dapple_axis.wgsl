// The third row of DappleXf: where light falls through leaves from (listing 3-3).
//
// gives: dapple_axis
// cost: 0
fn axis_as_given() -> vec3f {
    return axis_of_dapple();
}
