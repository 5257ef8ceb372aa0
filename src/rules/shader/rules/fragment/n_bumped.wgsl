// n = normalize(TBN decode(t, normal_strength)) (MODEL 3); without a direction the smooth normal, and
// without that -V (MODEL 7).
//
// gives: n
// fallback: normal
// when: bumped, corrected
// cost: 22
// uses: vector
fn bumped_normal(base: vec3f, bump: vec3f, normal: vec3f, view: vec3f, normal_strength: f32) -> vec3f {
    return normalize_or(base + normal_strength * bump, normalize_or(normal, -view));
}
