// The sky that a point sees: occlusion that knows which part of the environment is hidden (MODEL 10).
//
// effect: directional_occlusion, light of the part of the sky that a point sees, and what the skin throws back
// sample_field: sky_ratio: vec3f = 1; light that arrives of the environment, as a share of what an open point receives

// occ = 1 - occlusion (1 - ratio), a channel (MODEL 10).
//
// gives: ambient_open
// when: directional_occlusion, occlusion
// cost: 6
fn seen_of_sky(sky_ratio: vec3f, occlusion: f32) -> vec3f {
    return 1.0 - occlusion * (1.0 - sky_ratio);
}

// Where the effect `occlusion` is off its parameter counts as 1.
//
// gives: ambient_open
// when: directional_occlusion, !occlusion
// cost: 0
fn all_seen_of_sky(sky_ratio: vec3f) -> vec3f {
    return sky_ratio;
}
