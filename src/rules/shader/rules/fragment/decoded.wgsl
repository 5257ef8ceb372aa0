// 2 rgb - 1 (MODEL 3, corrected form). A texel that is not finite or decodes to nothing is the smooth
// normal (MODEL 7); a positive z never vanishes, so that the normal does not either.
//
// gives: decoded
// domain: texel, fragment
// when: corrected, bumped
// cost: 10
// uses: vector
fn decode_texel(normal_texel: vec3f) -> vec3f {
    let d: vec3f = 2.0 * normal_texel - 1.0;
    if (is_zero(d) || !is_finite(d)) {
        return vec3f(0.0, 0.0, 1.0);
    }
    return vec3f(d.xy, select(d.z, 1e-6, d.z >= 0.0 && d.z < 1e-6));
}
