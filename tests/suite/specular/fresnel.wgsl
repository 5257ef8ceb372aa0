// effect: fresnel, the environment in the skin's specular lobe, by the split sum
// parameter: specular_weight = 1 in [0, inf), rgb, linear; weight of specular light; MODEL 9
// parameter: roughness = 0.35 in [0.05, 1]; root mean square slope of the surface; MODEL 9
// parameter: gloss = 0 in [0, 0.9]; how much the specular map lowers the roughness; MODEL 9
// parameter: f0 = 0.028 in [0, 0.2]; reflectance when facing; MODEL 9
//
// m, the roughness that every formula takes (MODEL 9).
//
// gives: lobe_roughness
// cost: 4
// uses: specular
fn roughness_of_texel(roughness: f32, gloss: f32, specular: f32) -> f32 {
    return specular_roughness(roughness, gloss, specular);
}

// f0 a + b (MODEL 9).
//
// gives: reflected_share
// cost: 120
// uses: split_sum_kelemen
fn share_of_environment(n: vec3f, view: vec3f, lobe_roughness: f32, f0: f32) -> f32 {
    let sums: vec2f = split_sum_kelemen(max(-dot(n, view), 0.0), lobe_roughness);
    return f0 * sums.x + sums.y;
}

// specular_weight s E_r(R) (f0 a + b) (MODEL 9); the mirrored environment in the place of E_r.
//
// gives: reflected_part
// adds: fresnel
// cost: 8
fn reflected_light(reflected_share: f32, specular: f32, mirror_light: vec4f, specular_weight: vec3f) -> vec3f {
    return specular_weight * (specular * reflected_share * mirror_light.rgb);
}
