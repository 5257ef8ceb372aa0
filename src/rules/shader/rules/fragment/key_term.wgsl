// albedo (max(0, n.L) - max(0, N.L)): the bump map's contribution (GPU Gems chapter 3, last page).
//
// gives: key_term
// cost: 11
fn bump_under_key_light(albedo: vec3f, n: vec3f, normal: vec3f, key_direction: vec3f) -> vec3f {
    return (max(dot(n, key_direction), 0.0) - max(dot(normal, key_direction), 0.0)) * albedo;
}
