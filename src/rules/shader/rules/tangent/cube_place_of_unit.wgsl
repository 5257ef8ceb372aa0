// cube_place_of_unit along d_direction, the face held: s = (d.x / d.z + 1) / 2. cube_place hands on the listing's short
// directions too: none turns faster than one of length 1e-6, as on the CPU; beyond, squares of derivatives overflow.
fn cube_place_of_unit_tangent(direction: vec3f, d_direction: vec3f) -> vec3f {
    let face = face_met(direction);
    let d: vec3f = on_face(direction, face);
    let moved: vec3f = on_face(d_direction, face);
    let outwards: f32 = 1.0 / max(d.z, 1e-36);
    return vec3f(0.0, 0.5 * (moved.xy - d.xy * outwards * moved.z) * min(outwards, 1e6));
}
