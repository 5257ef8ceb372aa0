// S.w: light that falls through leaves from +Z, clamped at 0 (MODEL 3, corrected form).
//
// gives: dapple
// when: corrected, raster
// cost: 1
fn clamped_dapple(vertex_normal: vec3f) -> f32 {
    return max(vertex_normal.z, 0.0);
}
