// rim = S.y, interpolated from the corners of a stored sample's triangle (listing 3-3): their S.z ^ rim_exponent, each
// by its share.
//
// gives: rim
// when: interpolated_rim, !raster
// cost: 35
// uses: rim
fn rim_from_corners(corner_silhouettes: vec3f, corner_shares: vec3f, rim_exponent: f32) -> f32 {
    let rims: vec3f = vec3f(
        rim_power(corner_silhouettes.x, rim_exponent),
        rim_power(corner_silhouettes.y, rim_exponent),
        rim_power(corner_silhouettes.z, rim_exponent),
    );
    return dot(corner_shares, rims);
}
