// key_color key (GPU Gems chapter 3, last page).
//
// gives: key_part
// adds: key_light
// cost: 3
fn key_light_part(key_term: vec3f, key_color: vec3f) -> vec3f {
    return key_color * key_term;
}
