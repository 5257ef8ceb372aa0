// The diffuse light that is added towards the silhouette, of what is seen of the environment, and enters (MODEL 12).
//
// gives: rim_part
// shows: rim
// when: layered, !diffusion
// cost: 10
fn rim_light_layered(
    diffuse_term: vec3f,
    ambient_open: vec3f,
    entering: vec3f,
    rim: f32,
    rim_weight: vec3f,
) -> vec3f {
    return diffuse_term * (ambient_open * entering * (rim * rim_weight));
}
