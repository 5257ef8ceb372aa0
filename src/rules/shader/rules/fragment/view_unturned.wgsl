// The view in the environment's frame, which is not turned.
//
// gives: view_in_environment
// when: !turned
// cost: 0
fn unturned_view(view: vec3f) -> vec3f {
    return view;
}
