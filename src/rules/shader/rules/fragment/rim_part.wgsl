// The diffuse light that is added towards the silhouette (MODEL 3).
//
// gives: rim_part
// shows: rim
// when: !layered
// cost: 7
fn rim_light(diffuse_term: vec3f, occ: f32, rim: f32, rim_weight: vec3f) -> vec3f {
    return diffuse_term * (occ * rim * rim_weight);
}
