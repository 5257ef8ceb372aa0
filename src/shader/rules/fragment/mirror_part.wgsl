// reflection dapple E_s(R).rgb (MODEL 3).
//
// gives: mirror_part
// cost: 6
fn mirrored_light(mirror_light: vec4f, dapple: f32, reflection: vec3f) -> vec3f {
    return dapple * reflection * mirror_light.rgb;
}
