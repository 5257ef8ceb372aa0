
// A texel; outside the atlas nothing.
fn texel_at(place: vec2i) -> vec4f {
    let size = vec2i(textureDimensions({source}));
    let inside = all(place >= vec2i(0)) && all(place < size);
    return select(vec4f(0.0), textureLoad({source}, clamp(place, vec2i(0), size - 1), 0), inside);
}

// The mean of the filled texels among the eight neighbours, and in w how many these are.
fn mean_around(here: vec2i) -> vec4f {
    var sum = vec4f(0.0);
    for (var down = -1; down <= 1; down++) {
        for (var along = -1; along <= 1; along++) {
            let texel = texel_at(here + vec2i(along, down));
            sum += select(vec4f(0.0), vec4f(texel.xyz, 1.0), texel.w > 0.0 && (along != 0 || down != 0));
        }
    }
    return vec4f(sum.xyz / max(sum.w, 1.0), sum.w);
}

// A texel, where it is empty the mean of the filled ones among its neighbours, in the second ring of those that the first has
// filled (MODEL 6.5).
fn dilated(here: vec2i) -> vec4f {
    let size = vec2i(textureDimensions({source}));
    let middle = texel_at(here);
    if (middle.w > 0.0) {
        return middle;
    }
    let near = mean_around(here);
    if (near.w > 0.0) {
        return vec4f(near.xyz, 1.0);
    }
    var sum = vec4f(0.0);
    for (var down = -1; down <= 1; down++) {
        for (var along = -1; along <= 1; along++) {
            let place = here + vec2i(along, down);
            let inside = all(place >= vec2i(0)) && all(place < size);
            let first = mean_around(place);
            sum += select(vec4f(0.0), vec4f(first.xyz, 1.0), inside && first.w > 0.0);
        }
    }
    return vec4f(sum.xyz / max(sum.w, 1.0), min(sum.w, 1.0));
}

