// The mean of the filled texels among the eight neighbours, and in w how many these are.
fn {source}_around(here: vec2i) -> vec4f {
    var sum: vec4f = vec4f(0.0, 0.0, 0.0, 0.0);
    for (var down: i32 = -1; down <= 1; down++) {
        for (var along: i32 = -1; along <= 1; along++) {
            let texel: vec4f = {source}_near(here + vec2i(along, down));
            let counts: bool = texel.w > 0.0 && (along != 0 || down != 0);
            sum += select(0.0, 1.0, counts) * vec4f(texel.xyz, 1.0);
        }
    }
    return vec4f(sum.xyz / max(sum.w, 1.0), sum.w);
}

// A texel, where it is empty the mean of the filled ones among its neighbours, in the second ring of those that the first has
// filled (MODEL 6.5).
fn {name}_pass(here: vec2i) -> vec4f {
    let middle: vec4f = {source}_near(here);
    if (middle.w > 0.0) {
        return middle;
    }
    let ring: vec4f = {source}_around(here);
    if (ring.w > 0.0) {
        return vec4f(ring.xyz, 1.0);
    }
    var sum: vec4f = vec4f(0.0, 0.0, 0.0, 0.0);
    for (var down: i32 = -1; down <= 1; down++) {
        for (var along: i32 = -1; along <= 1; along++) {
            let place: vec2i = here + vec2i(along, down);
            let inside: bool = place.x >= 0 && place.y >= 0 && place.x < {size} && place.y < {size};
            let first: vec4f = {source}_around(place);
            sum += select(0.0, 1.0, inside && first.w > 0.0) * vec4f(first.xyz, 1.0);
        }
    }
    return vec4f(sum.xyz / max(sum.w, 1.0), min(sum.w, 1.0));
}
