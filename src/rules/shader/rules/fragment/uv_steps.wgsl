// How far the texture coordinates go to the fragment on the right (xy) and to the one below (zw).
//
// gives: uv_steps
// domain: texel, fragment
// when: !bilinear
// cost: 4
fn uv_steps_between_fragments(vertex_uv: vec2f) -> vec4f {
    return vec4f(dpdx(vertex_uv), dpdy(vertex_uv));
}
