
// A light of the scene stays where it is.
//
// gives: light_NAME_toward
// domain: texel, fragment
// cost: 0
fn light_NAME_in_world(light_NAME_bearing: vec3f) -> vec3f {
    return light_NAME_bearing;
}
