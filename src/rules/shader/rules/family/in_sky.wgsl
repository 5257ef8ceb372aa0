
// A light of the panorama turns with it about +Y.
//
// gives: light_NAME_toward
// domain: texel, fragment
// when: turned
// cost: 6
fn light_NAME_in_sky(light_NAME_bearing: vec3f, turn: vec2f) -> vec3f {
    let at: vec3f = light_NAME_bearing;
    return vec3f(turn.x * at.x + turn.y * at.z, at.y, turn.x * at.z - turn.y * at.x);
}

// The panorama as the scene turned it.
//
// gives: light_NAME_toward
// domain: texel, fragment
// when: !turned
// cost: 0
fn light_NAME_in_sky_at_rest(light_NAME_bearing: vec3f) -> vec3f {
    return light_NAME_bearing;
}
