// diffuse of what is seen of the environment, and enters (MODEL 12).
//
// gives: diffuse_part
// adds: diffuse, rim
// when: layered, !diffusion
// cost: 6
fn diffuse_light_layered(diffuse_term: vec3f, ambient_open: vec3f, diffuse_weight: vec3f) -> vec3f {
    return diffuse_term * (ambient_open * diffuse_weight);
}
