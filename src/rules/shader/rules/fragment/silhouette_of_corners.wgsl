// S.z, interpolated from the corners of a stored sample's triangle.
//
// gives: silhouette
// when: interpolated_rim, !raster
// cost: 5
fn silhouette_from_corners(corner_silhouettes: vec3f, corner_shares: vec3f) -> f32 {
    return dot(corner_shares, corner_silhouettes);
}
