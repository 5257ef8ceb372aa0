// E_d(n), the irradiance; filtered in the shader.
//
// gives: irradiance
// domain: texel, fragment
// cost: 22
// uses: cube, vector
// reads: irradiance_faces
fn irradiance_from_faces(n_place: vec3f) -> vec3f {
    return sample_faces(irradiance_faces, irradiance_faces_size(), n_place).rgb;
}
