// E_d(n), the irradiance; filtered by the hardware.
//
// gives: irradiance
// domain: texel, fragment
// cost: 12
// error: 0.004
// paper: yes
// reads: irradiance_cube, cube_sampler
fn irradiance_from_cube(n_in_environment: vec3f) -> vec3f {
    return textureSampleLevel(irradiance_cube, cube_sampler, n_in_environment, 0.0).rgb;
}
