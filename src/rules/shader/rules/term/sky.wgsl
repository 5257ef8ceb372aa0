// The sky that a point sees: occlusion that knows which part of the environment is hidden (MODEL 10).
//
// effect: directional_occlusion asks environment shares light bakes environment, light of the part of the sky that a point sees, and what the skin throws back
// sample_field: sky_ratio: vec3f = 1; light that arrives of the environment, as a share of what an open point receives
// sample_field: sky_cosine: vec3f = 0; how that moves with the cosine of the environment's turn
// sample_field: sky_sine: vec3f = 0; how it moves with the sine
// sample_field: sky_curve: vec3f = 0; how fast that change changes with the angle

// The ratio as it was found.
//
// gives: sky_share
// domain: texel, fragment
// when: directional_occlusion, !turning_sky
// cost: 0
fn share_of_sky(sky_ratio: vec3f) -> vec3f {
    return sky_ratio;
}

// The ratio as the environment turns by r from where it was found, at r0: ratio + ratio' sin(r - r0)
// + ratio'' (1 - cos(r - r0)), ratio' and ratio'' from the harmonics' own turn.
//
// gives: sky_share
// domain: texel, fragment
// when: directional_occlusion, turning_sky
// cost: 15
fn share_of_turning_sky(
    sky_ratio: vec3f,
    sky_cosine: vec3f,
    sky_sine: vec3f,
    sky_curve: vec3f,
    turn: vec2f,
) -> vec3f {
    return max(sky_ratio + (sky_curve + turn.x * sky_cosine + turn.y * sky_sine), vec3f(0.0));
}

// occ = 1 - occlusion (1 - ratio), a channel (MODEL 10).
//
// gives: sky_seen
// domain: texel, fragment
// when: directional_occlusion, occlusion
// cost: 6
fn seen_of_sky(sky_share: vec3f, occlusion: f32) -> vec3f {
    return 1.0 - occlusion * (1.0 - sky_share);
}

// Where the effect `occlusion` is off its parameter counts as 1.
//
// gives: sky_seen
// domain: texel, fragment
// when: directional_occlusion, !occlusion
// cost: 0
fn all_seen_of_sky(sky_share: vec3f) -> vec3f {
    return sky_share;
}

// What the skin throws back is none, or in the ratio.
//
// gives: ambient_open
// domain: texel, fragment
// when: directional_occlusion, !polynomial_bounces
// cost: 0
fn open_to_sky(sky_seen: vec3f) -> vec3f {
    return sky_seen;
}

// With what the skin throws back, by its albedo (Jimenez et al. 2016, Practical Real-Time Strategies for Accurate
// Indirect Occlusion).
//
// gives: ambient_open
// domain: texel, fragment
// when: directional_occlusion, polynomial_bounces
// cost: 30
fn open_to_sky_and_skin(sky_seen: vec3f, albedo: vec3f) -> vec3f {
    let a: vec3f = 2.0404 * albedo - 0.3324;
    let b: vec3f = 0.6417 - 4.7951 * albedo;
    let c: vec3f = 2.7552 * albedo + 0.6903;
    return max(sky_seen, ((sky_seen * a + b) * sky_seen + c) * sky_seen);
}
