// n = normalize(TBN decode(t, normal_strength)) at a texel (MODEL 3); without a direction the smooth normal.
//
// gives: n
// fallback: normal
// when: bumped, corrected
// cost: 22
// uses: vector
fn bumped_normal_at_texel(base: vec3f, bump: vec3f, normal: vec3f, normal_strength: f32) -> vec3f {
    return normalize_or(base + normal_strength * bump, normal);
}
