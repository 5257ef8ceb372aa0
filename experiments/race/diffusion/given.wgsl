// What the race's data gives ready made: ambient light and a key light's, of each texel.
//
// effect: given_light, light that texels hold
// parameter: given_key = 1 in [0, inf), rgb, linear; scale of the key light; the race
// field: given_ambient: vec3f = 0; light that stays
// field: given_irradiance: vec3f = 0; light of the key light at scale 1

// gives: given_lit
// domain: texel
// joins: diffusion_lit
// cost: 3
fn light_that_is_given(given_ambient: vec3f, given_irradiance: vec3f, given_key: vec3f) -> vec3f {
    return given_ambient + given_key * given_irradiance;
}

// All of it is scattered: nothing is added to the picture beside.
//
// gives: given_part
// adds: given_light
// cost: 0
fn nothing_more() -> vec3f {
    return vec3f(0.0);
}
