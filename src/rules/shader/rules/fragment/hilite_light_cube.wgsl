// E_h(V), the light behind the rim; filtered by the hardware.
//
// gives: hilite_light
// cost: 12
// error: 0.004
// paper: yes
// reads: hilite_cube, cube_sampler
fn hilite_light_from_cube(view_in_environment: vec3f) -> vec3f {
    return textureSampleLevel(hilite_cube, cube_sampler, view_in_environment, 0.0).rgb;
}
