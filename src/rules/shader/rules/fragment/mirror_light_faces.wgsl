// E_s(R), the mirrored environment; filtered in the shader.
//
// gives: mirror_light
// cost: 22
// uses: cube, vector
// reads: specular_faces
fn mirror_light_from_faces(reflected_place: vec3f) -> vec4f {
    return sample_faces(specular_faces, specular_faces_size(), reflected_place).rgba;
}
