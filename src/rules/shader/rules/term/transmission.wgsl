// Light that comes through thin parts: what arrives at the far side, weakened by how far it travels inside (MODEL 11; Barré-
// Brisebois and Bouchard 2011, Approximating Translucency for a Fast, Cheap and Convincing Subsurface Scattering Look).
//
// effect: transmission bakes environment, light that comes through thin parts of the skin
// parameter: transmission_weight = 0 in [0, inf), rgb, linear, weighs transmission; weight of light that comes through; model.md 11
// parameter: transmission_length = (3.7, 1.4, 0.7) in [0.05, 50], rgb, log, unit mm; how far light comes through skin before an e-th is left; Jensen et al. 2001
// parameter: transmission_unit = 1000 in [0, inf), held; millimetres in a unit of the scene; [mesh] metres_per_unit
// sample_field: thickness: f32 = 4000; millimetres from the surface to the far side, along -N
// sample_field: far_light_0: vec3f = 0; what arrives of the environment where rays inward leave at once
// sample_field: far_light_1: vec3f = 0; what arrives of the environment where rays inward leave after 0.1 mm
// sample_field: far_light_2: vec3f = 0; what arrives of the environment where rays inward leave after 0.2 mm
// sample_field: far_light_3: vec3f = 0; what arrives of the environment where rays inward leave after 0.4 mm
// sample_field: far_light_4: vec3f = 0; what arrives of the environment where rays inward leave after 0.8 mm
// sample_field: far_light_5: vec3f = 0; what arrives of the environment where rays inward leave after 1.5 mm
// sample_field: far_light_6: vec3f = 0; what arrives of the environment where rays inward leave after 3 mm
// sample_field: far_light_7: vec3f = 0; what arrives of the environment where rays inward leave after 5.5 mm
// sample_field: far_light_8: vec3f = 0; what arrives of the environment where rays inward leave after 10 mm
// sample_field: far_light_9: vec3f = 0; what arrives of the environment where rays inward leave after 18 mm
// sample_field: far_light_10: vec3f = 0; what arrives of the environment where rays inward leave after 32 mm
// sample_field: far_light_11: vec3f = 0; what arrives of the environment where rays inward leave after 50 mm
// sample_field: far_light: vec3f = 0; what arrives of the environment where rays inward leave, weakened on the way

// Into the skin: -N, the smooth normal, as bumps of the near side say nothing of the far one.
//
// gives: into_skin
// when: transmission
// cost: 3
fn inward_normal(normal: vec3f) -> vec3f {
    return -normal;
}

// The same in the environment's frame: Ry(r)^-1 d (MODEL 1).
//
// gives: into_environment
// when: transmission, turned
// cost: 5
fn turned_inward_normal(into_skin: vec3f, turn: vec2f) -> vec3f {
    let n: vec3f = into_skin;
    return vec3f(turn.x * n.x - turn.y * n.z, n.y, turn.y * n.x + turn.x * n.z);
}

// gives: into_environment
// when: transmission, !turned
// cost: 0
fn unturned_inward_normal(into_skin: vec3f) -> vec3f {
    return into_skin;
}

// Where -N meets the cube.
//
// gives: far_place
// when: transmission
// cost: 22
// uses: cube, vector
fn place_of_far_side(into_environment: vec3f) -> vec3f {
    return cube_place(into_environment);
}

// E_d(-N), filtered in the shader.
//
// gives: far_irradiance
// when: transmission
// cost: 22
// uses: cube, vector
// reads: irradiance_faces
fn far_from_faces(far_place: vec3f) -> vec3f {
    return sample_faces(irradiance_faces, irradiance_faces_size(), far_place).rgb;
}

// The same, filtered by the hardware.
//
// gives: far_irradiance
// when: transmission
// cost: 12
// error: 0.004
// paper: yes
// reads: irradiance_cube, cube_sampler
fn far_from_cube(into_environment: vec3f) -> vec3f {
    return textureSampleLevel(irradiance_cube, cube_sampler, into_environment, 0.0).rgb;
}

// What of the environment comes through, where the environment lights the skin at all.
//
// gives: ambient_through
// joins: transmission_lit
// when: transmission, diffuse, !gathered_through
// uses: transmission
// cost: 21
fn ambient_through_skin(far_irradiance: vec3f, thickness: f32, transmission_length: vec3f) -> vec3f {
    return transmitted(thickness, transmission_length) * far_irradiance;
}

// The same as it is gathered, told apart by distances inside (model::transmission::NODES).
//
// gives: ambient_through
// joins: transmission_lit
// when: transmission, diffuse, gathered_through, !raster
// uses: transmission
// cost: 230
fn gathered_through_skin(
    far_light_0: vec3f,
    far_light_1: vec3f,
    far_light_2: vec3f,
    far_light_3: vec3f,
    far_light_4: vec3f,
    far_light_5: vec3f,
    far_light_6: vec3f,
    far_light_7: vec3f,
    far_light_8: vec3f,
    far_light_9: vec3f,
    far_light_10: vec3f,
    far_light_11: vec3f,
    transmission_length: vec3f,
) -> vec3f {
    let sum_0: vec3f = far_light_0;
    let sum_1: vec3f = sum_0 + transmitted(0.1, transmission_length) * far_light_1;
    let sum_2: vec3f = sum_1 + transmitted(0.2, transmission_length) * far_light_2;
    let sum_3: vec3f = sum_2 + transmitted(0.4, transmission_length) * far_light_3;
    let sum_4: vec3f = sum_3 + transmitted(0.8, transmission_length) * far_light_4;
    let sum_5: vec3f = sum_4 + transmitted(1.5, transmission_length) * far_light_5;
    let sum_6: vec3f = sum_5 + transmitted(3.0, transmission_length) * far_light_6;
    let sum_7: vec3f = sum_6 + transmitted(5.5, transmission_length) * far_light_7;
    let sum_8: vec3f = sum_7 + transmitted(10.0, transmission_length) * far_light_8;
    let sum_9: vec3f = sum_8 + transmitted(18.0, transmission_length) * far_light_9;
    let sum_10: vec3f = sum_9 + transmitted(32.0, transmission_length) * far_light_10;
    return sum_10 + transmitted(50.0, transmission_length) * far_light_11;
}

// The same as a rasteriser has it of the vertices, weakened by the lengths that they were made with.
//
// gives: ambient_through
// joins: transmission_lit
// when: transmission, diffuse, gathered_through, raster
// cost: 0
fn vertices_through_skin(far_light: vec3f) -> vec3f {
    return far_light;
}

// Millimetres in a unit of the scene, of which shadow maps tell distances.
//
// gives: millimetres
// when: transmission
// cost: 0
fn millimetres_in_unit(transmission_unit: f32) -> f32 {
    return transmission_unit;
}

// All that comes through, of environment and lights, by the skin's colour. It enters at the far side: nothing that is
// reflected here is taken from it (MODEL 12).
//
// gives: transmission_part
// adds: transmission
// when: transmission
// cost: 6
fn light_through_skin(transmission_lit: vec3f, albedo: vec3f, transmission_weight: vec3f) -> vec3f {
    return transmission_weight * (albedo * transmission_lit);
}
