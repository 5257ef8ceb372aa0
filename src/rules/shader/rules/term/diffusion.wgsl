// Texture-space diffusion: the light of the skin stands in a map over its UV atlas, is blurred there as far as light wanders
// under the surface, and looked up again (MODEL 6; GPU Gems 3, chapter 14).
//
// effect: diffusion asks atlas shares light, light that scatters within the skin
// effect: diffusion_five within diffusion, two blurs more, as the human head demo has five
// parameter: diffusion_weight_1 = (0.23, 0.21, 0.01) in [0, 1], rgb, linear, share of diffused_light; share of the light in level 1; GPU Gems 3, chapter 14
// parameter: diffusion_weight_2 = (0.36, 0, 0) in [0, 1], rgb, linear, share of diffused_light; share of the light in level 2; GPU Gems 3, chapter 14
// parameter: diffusion_weight_3 = (0.08, 0, 0) in [0, 1], rgb, linear, share of diffused_light; share of the light in level 3; GPU Gems 3, chapter 14
// parameter: diffusion_weight_4 = 0 in [0, 1], rgb, linear, share of diffused_light, of diffusion_five; share of the light in level 4; GPU Gems 3, chapter 14
// parameter: diffusion_weight_5 = 0 in [0, 1], rgb, linear, share of diffused_light, of diffusion_five; share of the light in level 5; GPU Gems 3, chapter 14
// parameter: diffusion_radius_1 = 0.6 in [0.02, 30], log, unit mm; standard deviation of blur 1 on the surface; GPU Gems 3, chapter 14
// parameter: diffusion_radius_2 = 1.2 in [0.02, 30], log, unit mm; standard deviation of blur 2 on the surface; GPU Gems 3, chapter 14
// parameter: diffusion_radius_3 = 2.6 in [0.02, 30], log, unit mm; standard deviation of blur 3 on the surface; GPU Gems 3, chapter 14
// parameter: diffusion_radius_4 = 2.6 in [0.02, 30], log, unit mm, of diffusion_five; standard deviation of blur 4 on the surface; GPU Gems 3, chapter 14
// parameter: diffusion_radius_5 = 2.6 in [0.02, 30], log, unit mm, of diffusion_five; standard deviation of blur 5 on the surface; GPU Gems 3, chapter 14
// parameter: colour_mix = 0 in [0, 1]; power of the colour map before the blurs, the rest is after; GPU Gems 3, chapter 14
// parameter: diffusion_unit = 1000 in [0, inf), held; millimetres in a unit of the scene; [mesh] metres_per_unit

// Along which normal ambient light arrives: the smooth N, as the map is blurred anyway.
//
// gives: ambient_normal
// domain: texel
// when: diffusion, !bumped_ambient
// cost: 0
fn ambient_along_smooth_normal(normal: vec3f) -> vec3f {
    return normal;
}

// The bumped n.
//
// gives: ambient_normal
// domain: texel
// when: diffusion, bumped_ambient
// cost: 0
fn ambient_along_bumped_normal(n: vec3f) -> vec3f {
    return n;
}

// The same in the environment's frame: Ry(r)^-1 d (MODEL 1).
//
// gives: ambient_in_environment
// domain: texel
// when: diffusion, turned
// cost: 5
fn turned_ambient_normal(ambient_normal: vec3f, turn: vec2f) -> vec3f {
    let n: vec3f = ambient_normal;
    return vec3f(turn.x * n.x - turn.y * n.z, n.y, turn.y * n.x + turn.x * n.z);
}

// gives: ambient_in_environment
// domain: texel
// when: diffusion, !turned
// cost: 0
fn unturned_ambient_normal(ambient_normal: vec3f) -> vec3f {
    return ambient_normal;
}

// E_d along it, filtered in the shader.
//
// gives: ambient_irradiance
// domain: texel
// when: diffusion
// cost: 44
// uses: cube, vector
// reads: irradiance_faces
fn ambient_from_faces(ambient_in_environment: vec3f) -> vec3f {
    let place: vec3f = cube_place(ambient_in_environment);
    return sample_faces(irradiance_faces, irradiance_faces_size(), place).rgb;
}

// The same, filtered by the hardware.
//
// gives: ambient_irradiance
// domain: texel
// when: diffusion
// cost: 12
// error: 0.004
// paper: yes
// reads: irradiance_cube, cube_sampler
fn ambient_from_cube(ambient_in_environment: vec3f) -> vec3f {
    return textureSampleLevel(irradiance_cube, cube_sampler, ambient_in_environment, 0.0).rgb;
}

// A, the ambient light: what is seen of the environment (MODEL 10).
//
// gives: ambient_lit
// domain: texel
// joins: diffusion_lit
// when: diffusion, diffuse
// cost: 3
fn ambient_light(ambient_irradiance: vec3f, ambient_open: vec3f) -> vec3f {
    return ambient_irradiance * ambient_open;
}

// L_0 = c^m (A + sum of E_l / pi), the light map.
//
// gives: diffusion_level_0
// domain: texel
// sampled: 0
// when: diffusion
// uses: power
// cost: 40
fn light_map(albedo: vec3f, diffusion_lit: vec3f, colour_mix: f32) -> vec3f {
    return color_power(albedo, colour_mix) * diffusion_lit;
}

// The ambient light of the pixel: what is seen of the environment along the bumped n.
//
// gives: ambient_lit
// joins: diffusion_lit
// when: diffusion, diffuse, unblurred_in_pixel
// cost: 3
fn ambient_light_of_pixel(irradiance: vec3f, ambient_open: vec3f) -> vec3f {
    return irradiance * ambient_open;
}

// What no blur has moved: the light map.
//
// gives: diffusion_unblurred
// when: diffusion, !unblurred_in_pixel
// cost: 0
fn unblurred_in_map(diffusion_level_0: vec3f) -> vec3f {
    return diffusion_level_0;
}

// The same where it is seen, as sharp as the pixel's own normal and shadows.
//
// gives: diffusion_unblurred
// when: diffusion, unblurred_in_pixel
// uses: power
// cost: 40
fn unblurred_in_pixel(albedo: vec3f, diffusion_lit: vec3f, colour_mix: f32) -> vec3f {
    return color_power(albedo, colour_mix) * diffusion_lit;
}

// Where texels lie, in the scene's unit.
//
// gives: diffusion_position
// domain: texel
// when: diffusion, !exact_stretch
// cost: 0
fn position_of_texel(vertex_position: vec3f) -> vec3f {
    return vertex_position;
}

// The stretch of the atlas: how far texels lie apart along u and v, from neighbour to neighbour.
//
// gives: diffusion_stretch
// domain: texel
// when: diffusion, !exact_stretch
// pass: diffusion_position: vec3f, neighbours
// cost: 20
fn stretch_by_differences(apart: vec2f) -> vec2f {
    return apart;
}

// The same by the triangle's Jacobian.
//
// gives: diffusion_stretch
// domain: texel
// when: diffusion, exact_stretch
// cost: 20
fn stretch_of_triangle(vertex_position: vec3f) -> vec2f {
    let along: vec3f = dpdx(vertex_position);
    let down: vec3f = dpdy(vertex_position);
    return sqrt(vec2f(dot(along, along), dot(down, down)));
}

// L_1, a blur of L_0: its standard deviation in texels, 0 where texels lie on one another.
//
// gives: diffusion_level_1
// domain: texel
// sampled: 0
// when: diffusion, !surface_levels
// pass: diffusion_level_0: vec3f, gaussian
// cost: 8
fn deviation_1(axis: vec2f, diffusion_stretch: vec2f, diffusion_radius_1: f32, diffusion_unit: f32) -> f32 {
    let step: f32 = diffusion_unit * dot(diffusion_stretch, axis);
    return select(0.0, min(diffusion_radius_1 / max(step, 1e-20), 1e6), step > 0.0);
}

// L_2, a blur of L_1: its standard deviation in texels, 0 where texels lie on one another.
//
// gives: diffusion_level_2
// domain: texel
// sampled: 0
// when: diffusion, !surface_levels
// pass: diffusion_level_1: vec3f, gaussian
// cost: 8
fn deviation_2(axis: vec2f, diffusion_stretch: vec2f, diffusion_radius_2: f32, diffusion_unit: f32) -> f32 {
    let step: f32 = diffusion_unit * dot(diffusion_stretch, axis);
    return select(0.0, min(diffusion_radius_2 / max(step, 1e-20), 1e6), step > 0.0);
}

// L_3, a blur of L_2: its standard deviation in texels, 0 where texels lie on one another.
//
// gives: diffusion_level_3
// domain: texel
// sampled: 0
// when: diffusion, !surface_levels
// pass: diffusion_level_2: vec3f, gaussian
// cost: 8
fn deviation_3(axis: vec2f, diffusion_stretch: vec2f, diffusion_radius_3: f32, diffusion_unit: f32) -> f32 {
    let step: f32 = diffusion_unit * dot(diffusion_stretch, axis);
    return select(0.0, min(diffusion_radius_3 / max(step, 1e-20), 1e6), step > 0.0);
}

// L_4, a blur of L_3: its standard deviation in texels, 0 where texels lie on one another.
//
// gives: diffusion_level_4
// domain: texel
// sampled: 0
// when: diffusion_five, !surface_levels
// pass: diffusion_level_3: vec3f, gaussian
// cost: 8
fn deviation_4(axis: vec2f, diffusion_stretch: vec2f, diffusion_radius_4: f32, diffusion_unit: f32) -> f32 {
    let step: f32 = diffusion_unit * dot(diffusion_stretch, axis);
    return select(0.0, min(diffusion_radius_4 / max(step, 1e-20), 1e6), step > 0.0);
}

// L_5, a blur of L_4: its standard deviation in texels, 0 where texels lie on one another.
//
// gives: diffusion_level_5
// domain: texel
// sampled: 0
// when: diffusion_five, !surface_levels
// pass: diffusion_level_4: vec3f, gaussian
// cost: 8
fn deviation_5(axis: vec2f, diffusion_stretch: vec2f, diffusion_radius_5: f32, diffusion_unit: f32) -> f32 {
    let step: f32 = diffusion_unit * dot(diffusion_stretch, axis);
    return select(0.0, min(diffusion_radius_5 / max(step, 1e-20), 1e6), step > 0.0);
}

// Where texels lie, in millimetres.
//
// gives: diffusion_place
// domain: texel
// when: diffusion, surface_levels
// cost: 3
fn place_in_millimetres(vertex_position: vec3f, diffusion_unit: f32) -> vec3f {
    return diffusion_unit * vertex_position;
}

// Which way texels face: the smooth N.
//
// gives: diffusion_facing
// domain: texel
// when: diffusion, surface_levels
// cost: 0
fn facing_of_texel(normal: vec3f) -> vec3f {
    return normal;
}

// The area of texels on the surface in square millimetres, by the triangle's Jacobian.
//
// gives: diffusion_area
// domain: texel
// when: diffusion, surface_levels
// cost: 20
fn area_of_texel(vertex_position: vec3f, diffusion_unit: f32) -> f32 {
    let along: vec3f = diffusion_unit * dpdx(vertex_position);
    let down: vec3f = diffusion_unit * dpdy(vertex_position);
    let across: vec3f = cross(along, down);
    return sqrt(dot(across, across));
}

// L_1 over the surface: of L_0 at once, its variance that of all blurs so far, in mm^2 (MODEL 6, "Truth").
//
// gives: diffusion_level_1
// domain: texel
// sampled: 0
// when: diffusion, surface_levels
// pass: diffusion_level_0: vec3f, surface of diffusion_place, diffusion_facing, diffusion_area
// cost: 2
fn variance_1(diffusion_radius_1: f32) -> f32 {
    return diffusion_radius_1 * diffusion_radius_1;
}

// L_2 over the surface: of L_0 at once, its variance that of all blurs so far, in mm^2 (MODEL 6, "Truth").
//
// gives: diffusion_level_2
// domain: texel
// sampled: 0
// when: diffusion, surface_levels
// pass: diffusion_level_0: vec3f, surface of diffusion_place, diffusion_facing, diffusion_area
// cost: 4
fn variance_2(diffusion_radius_1: f32, diffusion_radius_2: f32) -> f32 {
    return diffusion_radius_1 * diffusion_radius_1 + diffusion_radius_2 * diffusion_radius_2;
}

// L_3 over the surface: of L_0 at once, its variance that of all blurs so far, in mm^2 (MODEL 6, "Truth").
//
// gives: diffusion_level_3
// domain: texel
// sampled: 0
// when: diffusion, surface_levels
// pass: diffusion_level_0: vec3f, surface of diffusion_place, diffusion_facing, diffusion_area
// cost: 6
fn variance_3(diffusion_radius_1: f32, diffusion_radius_2: f32, diffusion_radius_3: f32) -> f32 {
    return diffusion_radius_1 * diffusion_radius_1
        + diffusion_radius_2 * diffusion_radius_2
        + diffusion_radius_3 * diffusion_radius_3;
}

// L_4 over the surface: of L_0 at once, its variance that of all blurs so far, in mm^2 (MODEL 6, "Truth").
//
// gives: diffusion_level_4
// domain: texel
// sampled: 0
// when: diffusion_five, surface_levels
// pass: diffusion_level_0: vec3f, surface of diffusion_place, diffusion_facing, diffusion_area
// cost: 8
fn variance_4(
    diffusion_radius_1: f32,
    diffusion_radius_2: f32,
    diffusion_radius_3: f32,
    diffusion_radius_4: f32,
) -> f32 {
    return diffusion_radius_1 * diffusion_radius_1
        + diffusion_radius_2 * diffusion_radius_2
        + diffusion_radius_3 * diffusion_radius_3
        + diffusion_radius_4 * diffusion_radius_4;
}

// L_5 over the surface: of L_0 at once, its variance that of all blurs so far, in mm^2 (MODEL 6, "Truth").
//
// gives: diffusion_level_5
// domain: texel
// sampled: 0
// when: diffusion_five, surface_levels
// pass: diffusion_level_0: vec3f, surface of diffusion_place, diffusion_facing, diffusion_area
// cost: 10
fn variance_5(
    diffusion_radius_1: f32,
    diffusion_radius_2: f32,
    diffusion_radius_3: f32,
    diffusion_radius_4: f32,
    diffusion_radius_5: f32,
) -> f32 {
    return diffusion_radius_1 * diffusion_radius_1
        + diffusion_radius_2 * diffusion_radius_2
        + diffusion_radius_3 * diffusion_radius_3
        + diffusion_radius_4 * diffusion_radius_4
        + diffusion_radius_5 * diffusion_radius_5;
}

// sum of w_k L_k, where w_0 is 1 less the others.
//
// gives: scattered_light
// when: diffusion, !diffusion_five, !combined_in_map
// cost: 27
fn scattered_of_three(
    diffusion_unblurred: vec3f,
    diffusion_level_1: vec3f,
    diffusion_level_2: vec3f,
    diffusion_level_3: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
) -> vec3f {
    return diffusion_unblurred
        + diffusion_weight_1 * (diffusion_level_1 - diffusion_unblurred)
        + diffusion_weight_2 * (diffusion_level_2 - diffusion_unblurred)
        + diffusion_weight_3 * (diffusion_level_3 - diffusion_unblurred);
}

// sum of w_k L_k, where w_0 is 1 less the others.
//
// gives: scattered_light
// when: diffusion, diffusion_five, !combined_in_map
// cost: 45
fn scattered_of_five(
    diffusion_unblurred: vec3f,
    diffusion_level_1: vec3f,
    diffusion_level_2: vec3f,
    diffusion_level_3: vec3f,
    diffusion_level_4: vec3f,
    diffusion_level_5: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
    diffusion_weight_4: vec3f,
    diffusion_weight_5: vec3f,
) -> vec3f {
    return diffusion_unblurred
        + diffusion_weight_1 * (diffusion_level_1 - diffusion_unblurred)
        + diffusion_weight_2 * (diffusion_level_2 - diffusion_unblurred)
        + diffusion_weight_3 * (diffusion_level_3 - diffusion_unblurred)
        + diffusion_weight_4 * (diffusion_level_4 - diffusion_unblurred)
        + diffusion_weight_5 * (diffusion_level_5 - diffusion_unblurred);
}

// The same in texels: a lookup is linear, so that the sum's is the sum of the levels' lookups.
//
// gives: scattered_light
// domain: texel
// sampled: 0
// when: diffusion, !diffusion_five, combined_in_map, !unblurred_in_pixel
// cost: 27
fn scattered_of_three_in_map(
    diffusion_level_0: vec3f,
    diffusion_level_1: vec3f,
    diffusion_level_2: vec3f,
    diffusion_level_3: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
) -> vec3f {
    return diffusion_level_0
        + diffusion_weight_1 * (diffusion_level_1 - diffusion_level_0)
        + diffusion_weight_2 * (diffusion_level_2 - diffusion_level_0)
        + diffusion_weight_3 * (diffusion_level_3 - diffusion_level_0);
}

// The same in texels: a lookup is linear, so that the sum's is the sum of the levels' lookups.
//
// gives: scattered_light
// domain: texel
// sampled: 0
// when: diffusion, diffusion_five, combined_in_map, !unblurred_in_pixel
// cost: 45
fn scattered_of_five_in_map(
    diffusion_level_0: vec3f,
    diffusion_level_1: vec3f,
    diffusion_level_2: vec3f,
    diffusion_level_3: vec3f,
    diffusion_level_4: vec3f,
    diffusion_level_5: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
    diffusion_weight_4: vec3f,
    diffusion_weight_5: vec3f,
) -> vec3f {
    return diffusion_level_0
        + diffusion_weight_1 * (diffusion_level_1 - diffusion_level_0)
        + diffusion_weight_2 * (diffusion_level_2 - diffusion_level_0)
        + diffusion_weight_3 * (diffusion_level_3 - diffusion_level_0)
        + diffusion_weight_4 * (diffusion_level_4 - diffusion_level_0)
        + diffusion_weight_5 * (diffusion_level_5 - diffusion_level_0);
}

// What blurs have moved, in texels.
//
// gives: diffusion_moved
// domain: texel
// sampled: 0
// when: diffusion, !diffusion_five, combined_in_map, unblurred_in_pixel
// cost: 15
fn moved_of_three_in_map(
    diffusion_level_1: vec3f,
    diffusion_level_2: vec3f,
    diffusion_level_3: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
) -> vec3f {
    return diffusion_weight_1 * diffusion_level_1
        + diffusion_weight_2 * diffusion_level_2
        + diffusion_weight_3 * diffusion_level_3;
}

// What blurs have moved, in texels.
//
// gives: diffusion_moved
// domain: texel
// sampled: 0
// when: diffusion, diffusion_five, combined_in_map, unblurred_in_pixel
// cost: 27
fn moved_of_five_in_map(
    diffusion_level_1: vec3f,
    diffusion_level_2: vec3f,
    diffusion_level_3: vec3f,
    diffusion_level_4: vec3f,
    diffusion_level_5: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
    diffusion_weight_4: vec3f,
    diffusion_weight_5: vec3f,
) -> vec3f {
    return diffusion_weight_1 * diffusion_level_1
        + diffusion_weight_2 * diffusion_level_2
        + diffusion_weight_3 * diffusion_level_3
        + diffusion_weight_4 * diffusion_level_4
        + diffusion_weight_5 * diffusion_level_5;
}

// What no blur has moved counts w_0, 1 less the other weights.
//
// gives: scattered_light
// when: diffusion, !diffusion_five, combined_in_map, unblurred_in_pixel
// cost: 15
fn scattered_beside_three(
    diffusion_unblurred: vec3f,
    diffusion_moved: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
) -> vec3f {
    return diffusion_moved + (vec3f(1.0) - diffusion_weight_1 - diffusion_weight_2 - diffusion_weight_3) * diffusion_unblurred;
}

// What no blur has moved counts w_0, 1 less the other weights.
//
// gives: scattered_light
// when: diffusion, diffusion_five, combined_in_map, unblurred_in_pixel
// cost: 21
fn scattered_beside_five(
    diffusion_unblurred: vec3f,
    diffusion_moved: vec3f,
    diffusion_weight_1: vec3f,
    diffusion_weight_2: vec3f,
    diffusion_weight_3: vec3f,
    diffusion_weight_4: vec3f,
    diffusion_weight_5: vec3f,
) -> vec3f {
    return diffusion_moved + (vec3f(1.0) - diffusion_weight_1 - diffusion_weight_2 - diffusion_weight_3 - diffusion_weight_4 - diffusion_weight_5) * diffusion_unblurred;
}

// c^(1 - m): the rest of the colour, over the blurs.
//
// gives: color_after
// when: diffusion
// uses: power
// cost: 34
fn color_after_blurs(albedo: vec3f, colour_mix: f32) -> vec3f {
    return color_power(albedo, 1.0 - colour_mix);
}

// What scattered light shows before the diffuse weights.
//
// gives: diffused
// when: diffusion
// cost: 3
fn diffused_light(color_after: vec3f, scattered_light: vec3f) -> vec3f {
    return color_after * scattered_light;
}

// All diffuse light, ambient and of lamps, of what enters (MODEL 12).
//
// gives: diffuse_part
// adds: diffuse, rim
// when: diffusion
// cost: 3
fn diffuse_light_scattered(diffused: vec3f, diffuse_weight: vec3f) -> vec3f {
    return diffused * diffuse_weight;
}

// What of it is seen from any angle.
//
// gives: base_part
// shows: diffuse
// when: diffusion
// cost: 6
fn base_light_scattered(diffused: vec3f, entering: vec3f, base_weight: vec3f) -> vec3f {
    return diffused * (entering * base_weight);
}

// What of it is added towards the silhouette.
//
// gives: rim_part
// shows: rim
// when: diffusion, rim
// cost: 7
fn rim_light_scattered(diffused: vec3f, entering: vec3f, rim: f32, rim_weight: vec3f) -> vec3f {
    return diffused * (entering * (rim * rim_weight));
}

// The widest level.
//
// gives: diffusion_widest
// when: diffusion, !diffusion_five
// cost: 0
fn widest_of_three(diffusion_level_3: vec3f) -> vec3f {
    return diffusion_level_3;
}

// The widest level.
//
// gives: diffusion_widest
// when: diffusion, diffusion_five
// cost: 0
fn widest_of_five(diffusion_level_5: vec3f) -> vec3f {
    return diffusion_level_5;
}
