// From the texel's one neighbour of the same chart to the other, half of it, along u and v; to the one that there is; 0 with
// none (MODEL 6).
fn {name}_pass(here: vec2i) -> vec4f {
    let middle: vec4f = {source}_near(here);
    if (middle.w == 0.0) {
        return vec4f(0.0, 0.0, 0.0, 0.0);
    }
    let left: vec4f = {source}_near(here - vec2i(1, 0));
    let right: vec4f = {source}_near(here + vec2i(1, 0));
    let above: vec4f = {source}_near(here - vec2i(0, 1));
    let below: vec4f = {source}_near(here + vec2i(0, 1));
    let u: vec3f = select(middle.xyz, right.xyz, right.w == middle.w) - select(middle.xyz, left.xyz, left.w == middle.w);
    let v: vec3f = select(middle.xyz, below.xyz, below.w == middle.w) - select(middle.xyz, above.xyz, above.w == middle.w);
    let both_u: bool = left.w == middle.w && right.w == middle.w;
    let both_v: bool = above.w == middle.w && below.w == middle.w;
    let apart: vec2f = vec2f(select(1.0, 0.5, both_u) * length(u), select(1.0, 0.5, both_v) * length(v));
{reads}    return {value};
}
