// reflection dapple E_s(R).rgb (MODEL 3).
//
// gives: mirror_part
// adds: reflection
// cost: 3
fn mirrored_light(mirror_term: vec3f, reflection: vec3f) -> vec3f {
    return reflection * mirror_term;
}
