// E_s(R), the mirrored environment; filtered by the hardware.
//
// gives: mirror_light
// cost: 12
// error: 0.004
// paper: yes
// reads: specular_cube, cube_sampler
fn mirror_light_from_cube(reflected_in_environment: vec3f) -> vec4f {
    return textureSampleLevel(specular_cube, cube_sampler, reflected_in_environment, 0.0).rgba;
}
