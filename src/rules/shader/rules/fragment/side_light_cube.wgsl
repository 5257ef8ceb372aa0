// E_s(n), what shines from the side; filtered by the hardware.
//
// gives: side_light
// domain: texel, fragment
// cost: 12
// error: 0.004
// paper: yes
// reads: specular_cube, cube_sampler
fn side_light_from_cube(n_in_environment: vec3f) -> vec3f {
    return textureSampleLevel(specular_cube, cube_sampler, n_in_environment, 0.0).rgb;
}
