// E_s(n), what shines from the side; filtered in the shader.
//
// gives: side_light
// domain: texel, fragment
// cost: 22
// uses: cube, vector
// reads: specular_faces
fn side_light_from_faces(n_place: vec3f) -> vec3f {
    return sample_faces(specular_faces, specular_faces_size(), n_place).rgb;
}
