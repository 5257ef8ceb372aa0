// The texel as it is (listing 3-4). One that is zero or not finite is the smooth normal (MODEL 7), and a z of 0
// leaves a trace of it, as in the corrected form.
//
// gives: decoded
// domain: texel, fragment
// when: listing, bumped
// cost: 7
// uses: vector
fn texel_as_listed(normal_texel: vec3f) -> vec3f {
    if (is_zero(normal_texel) || !is_finite(normal_texel)) {
        return vec3f(0.0, 0.0, 1.0);
    }
    return vec3f(normal_texel.xy, select(normal_texel.z, 1e-6, normal_texel.z >= 0.0 && normal_texel.z < 1e-6));
}
