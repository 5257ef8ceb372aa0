// A texel of the level; outside the atlas nothing.
fn {level}_near(place: vec2i) -> vec4f {
    let inside: bool = place.x >= 0 && place.y >= 0 && place.x < {size} && place.y < {size};
    let held: vec2i = vec2i(min(max(place.x, 0), {size} - 1), min(max(place.y, 0), {size} - 1));
    return select(vec4f(0.0, 0.0, 0.0, 0.0), textureLoad({level}, held, 0), inside);
}
