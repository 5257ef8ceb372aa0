
// E_l / pi before its colour: what the light NAME brings to the bumped normal, once for a white surface.
//
// gives: light_NAME_facing
// domain: texel, fragment
// cost: 8
fn light_NAME_cosine(n: vec3f, light_NAME_toward: vec3f, light_NAME_arriving: f32) -> f32 {
    return 0.3183098861837907 * (max(dot(n, light_NAME_toward), 0.0) * light_NAME_arriving);
}

// What the light NAME shows of the skin (MODEL 12).
//
// gives: light_NAME_part
// adds: light_NAME
// when: lights, !diffusion
// cost: 6
fn light_NAME_shown(light_NAME_term: vec3f, diffuse_weight: vec3f, light_NAME_color: vec3f) -> vec3f {
    return light_NAME_color * diffuse_weight * light_NAME_term;
}

// The BRDF of Kelemen and Szirmay-Kalos for the light NAME, over weight and s.
//
// gives: light_NAME_brdf
// when: light_specular, kelemen, corrected
// cost: 60
// uses: specular
fn light_NAME_kelemen(n: vec3f, view: vec3f, light_NAME_toward: vec3f, lobe_roughness: f32, lobe_f0: f32) -> f32 {
    return kelemen_brdf(n, view, light_NAME_toward, lobe_roughness, lobe_f0);
}

// GGX for the light NAME, over weight and s.
//
// gives: light_NAME_brdf
// when: light_specular, ggx, corrected
// cost: 80
// uses: specular
fn light_NAME_ggx(n: vec3f, view: vec3f, light_NAME_toward: vec3f, lobe_roughness: f32, lobe_f0: f32) -> f32 {
    return ggx_brdf(n, view, light_NAME_toward, lobe_roughness, lobe_f0);
}

// The listing's normal and view are of any length: a BRDF is of directions.
//
// gives: light_NAME_brdf
// when: light_specular, kelemen, listing
// cost: 80
// uses: vector, specular
fn light_NAME_kelemen_as_listed(
    n: vec3f,
    view: vec3f,
    light_NAME_toward: vec3f,
    lobe_roughness: f32,
    lobe_f0: f32,
) -> f32 {
    let none: vec3f = vec3f(0.0);
    return kelemen_brdf(normalize_or(n, none), normalize_or(view, none), light_NAME_toward, lobe_roughness, lobe_f0);
}

// gives: light_NAME_brdf
// when: light_specular, ggx, listing
// cost: 100
// uses: vector, specular
fn light_NAME_ggx_as_listed(
    n: vec3f,
    view: vec3f,
    light_NAME_toward: vec3f,
    lobe_roughness: f32,
    lobe_f0: f32,
) -> f32 {
    let none: vec3f = vec3f(0.0);
    return ggx_brdf(normalize_or(n, none), normalize_or(view, none), light_NAME_toward, lobe_roughness, lobe_f0);
}

// s f E_l, before its colour and the specular weight; `facing` has E_l over pi.
//
// gives: light_NAME_glint
// when: lights, light_specular
// cost: 6
fn light_NAME_in_lobe(
    light_NAME_brdf: f32,
    light_NAME_facing: f32,
    light_NAME_irradiance: vec3f,
    lobe_weight: f32,
) -> vec3f {
    return (3.141592653589793 * (lobe_weight * light_NAME_brdf * light_NAME_facing)) * light_NAME_irradiance;
}

// What the skin mirrors of the light NAME (MODEL 9).
//
// gives: light_NAME_specular_part
// adds: light_NAME_specular
// when: lights, light_specular
// cost: 6
fn light_NAME_mirrored(light_NAME_glint: vec3f, specular_weight: vec3f, light_NAME_color: vec3f) -> vec3f {
    return light_NAME_color * specular_weight * light_NAME_glint;
}

// How far the light NAME travels inside, in millimetres, as rays find it.
//
// gives: light_NAME_inside
// when: lights, transmission, !translucent_maps
// cost: 0
fn light_NAME_found_inside(light_NAME_depth: f32) -> f32 {
    return light_NAME_depth;
}

// What of the light NAME comes through the skin: E_l(-N) / pi at the far side, weakened by its own way (MODEL 11).
//
// gives: light_NAME_through
// joins: transmission_lit
// when: lights, transmission, !gathered_through
// uses: transmission
// cost: 36
fn light_NAME_through_skin(
    into_skin: vec3f,
    light_NAME_toward: vec3f,
    light_NAME_beyond: f32,
    light_NAME_inside: f32,
    light_NAME_irradiance: vec3f,
    light_NAME_color: vec3f,
    transmission_length: vec3f,
) -> vec3f {
    let facing: f32 = 0.3183098861837907 * (max(dot(into_skin, light_NAME_toward), 0.0) * light_NAME_beyond);
    return light_NAME_color * (transmitted(light_NAME_inside, transmission_length) * (facing * light_NAME_irradiance));
}

// The same as it is gathered, told apart by distances inside (model::transmission::NODES), three to a field.
//
// gives: light_NAME_through
// joins: transmission_lit
// when: lights, transmission, gathered_through, !raster
// uses: transmission
// cost: 250
fn light_NAME_gathered_through_skin(
    light_NAME_far_light_0: vec3f,
    light_NAME_far_light_1: vec3f,
    light_NAME_far_light_2: vec3f,
    light_NAME_far_light_3: vec3f,
    light_NAME_irradiance: vec3f,
    light_NAME_color: vec3f,
    transmission_length: vec3f,
) -> vec3f {
    let sum_0: vec3f = vec3f(light_NAME_far_light_0.x);
    let sum_1: vec3f = sum_0 + transmitted(0.1, transmission_length) * light_NAME_far_light_0.y;
    let sum_2: vec3f = sum_1 + transmitted(0.2, transmission_length) * light_NAME_far_light_0.z;
    let sum_3: vec3f = sum_2 + transmitted(0.4, transmission_length) * light_NAME_far_light_1.x;
    let sum_4: vec3f = sum_3 + transmitted(0.8, transmission_length) * light_NAME_far_light_1.y;
    let sum_5: vec3f = sum_4 + transmitted(1.5, transmission_length) * light_NAME_far_light_1.z;
    let sum_6: vec3f = sum_5 + transmitted(3.0, transmission_length) * light_NAME_far_light_2.x;
    let sum_7: vec3f = sum_6 + transmitted(5.5, transmission_length) * light_NAME_far_light_2.y;
    let sum_8: vec3f = sum_7 + transmitted(10.0, transmission_length) * light_NAME_far_light_2.z;
    let sum_9: vec3f = sum_8 + transmitted(18.0, transmission_length) * light_NAME_far_light_3.x;
    let sum_10: vec3f = sum_9 + transmitted(32.0, transmission_length) * light_NAME_far_light_3.y;
    let sum_11: vec3f = sum_10 + transmitted(50.0, transmission_length) * light_NAME_far_light_3.z;
    return light_NAME_color * (sum_11 * light_NAME_irradiance);
}

// The same as a rasteriser has it of the vertices, weakened by the lengths that they were made with.
//
// gives: light_NAME_through
// joins: transmission_lit
// when: lights, transmission, gathered_through, raster
// cost: 6
fn light_NAME_vertices_through_skin(
    light_NAME_far_light: vec3f,
    light_NAME_irradiance: vec3f,
    light_NAME_color: vec3f,
) -> vec3f {
    return light_NAME_color * (light_NAME_far_light * light_NAME_irradiance);
}
