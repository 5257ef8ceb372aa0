// What albedo and irradiance show from any angle, of what is seen of the environment, and enters (MODEL 12).
//
// gives: base_part
// shows: diffuse
// when: layered, !diffusion
// cost: 9
fn base_light_layered(diffuse_term: vec3f, ambient_open: vec3f, entering: vec3f, base_weight: vec3f) -> vec3f {
    return diffuse_term * (ambient_open * entering * base_weight);
}
