// E_h(V), the light behind the rim; filtered in the shader.
//
// gives: hilite_light
// cost: 22
// uses: cube, vector
// reads: hilite_faces
fn hilite_light_from_faces(view_place: vec3f) -> vec3f {
    return sample_faces(hilite_faces, hilite_faces_size(), view_place).rgb;
}
